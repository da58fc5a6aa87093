#!/usr/bin/env bash
# The studies that ship with the docs: validation/studies/run.sh [PROGRAM] [RESULTS=docs/results] [WORK=out]
# Each goes on where it was stopped (amontons study); tables and plots go to RESULTS.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=${1:-build/release/bin/amontons}
results=${2:-docs/results}
work=${3:-out}

# ship NAME: the table and the plot of a study
ship() {
    cp "$work/$1/study.csv" "$results/study_$1.csv"
    cp "$work/$1/study.svg" "$results/study_$1.svg"
}

"$program" study validation/studies/uzawa-contrast/scene.json \
    --sweep bodies.soft.youngs_modulus=1,1e1,1e2,1e3,1e4,1e5,1e6,1e7,1e8,1e9 \
    --sweep accuracy.solver=uzawa,nsgs,anderson,newton,auto \
    --quantity iterations --reference 0 --output "$work/uzawa_contrast"
ship uzawa_contrast

"$program" study validation/studies/hertz-elements/scene.json \
    --sweep bodies.block.mesh.cells='[6,6,6],[8,8,8],[12,12,12],[16,16,16]' \
    --sweep bodies.block.mesh.element=T4,T10,H8 \
    --quantity block_on_ball_force_z --output "$work/hertz_elements"
ship hertz_elements
