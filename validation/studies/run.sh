#!/usr/bin/env bash
# The studies that ship with the docs: validation/studies/run.sh [PROGRAM] [RESULTS=docs/results] [WORK=out]
# Each continues where it was stopped (amontons study); tables and plots are passed to RESULTS.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=${1:-build/release/bin/amontons}
results=${2:-docs/results}
work=${3:-out}
turning=$(dirname "$program")/rod10_bench
if [[ ! -x $program || ! -x $turning ]]; then
    echo "run.sh: found no $program or no $turning, allowed: both (cmake --build --preset release --target amontons rod10_bench)" >&2
    exit 2
fi

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
    --quantity ball_on_block_force_z --output "$work/hertz_elements"
ship hertz_elements

# half the work on Timoshenko's cantilever: P^2 (L^3 / 3 EI + 6 L / 5 GA) / 2
"$program" study validation/studies/bending-elements/scene.json \
    --sweep bodies.beam.mesh.cells='[10,1,1],[20,2,2],[40,4,4],[80,8,8]' \
    --sweep bodies.beam.mesh.element=T4,T10,H8 \
    --quantity energy.elastic --reference 1.6024e-7 --output "$work/bending_elements"
ship bending_elements

"$program" study examples/double-u/scene.json --set output.picture=false \
    --sweep time.step=0.32,0.16,0.08,0.04,0.02,0.01,0.005 \
    --quantity energy.friction --output "$work/step_length"
ship step_length

"$program" study validation/studies/nodal-mortar/scene.json \
    --sweep bodies.upper.mesh.cells,bodies.lower.mesh.cells='[4,4,2],[6,6,3],[8,8,4],[12,12,6],[16,16,8],[24,24,12]' \
    --sweep contact.0.discretisation=nodal,mortar \
    --quantity upper_z_max_force_x --output "$work/nodal_mortar"
ship nodal_mortar

# a rod that turns by a degree a frame, with its matrix re-oriented in every k-th frame
"$turning" turning > "$results/rod10_turning.csv"
gnuplot -e "table='$results/rod10_turning.csv'; plot_file='$results/rod10_turning.svg'" \
    validation/studies/rod10-turning/plot.gp

# a guidewire in an arch of rubber that is stiffer and stiffer, and in a rigid one
validation/studies/soft-vessel/push.py "$program" examples/soft_vessel/scene.json "$work" \
    "$results/soft_vessel_push.csv"
gnuplot -e "table='$results/soft_vessel_push.csv'; plot_file='$results/soft_vessel_push.svg'" \
    validation/studies/soft-vessel/plot.gp
validation/studies/soft-vessel/push.py "$program" examples/soft_vessel/scene.json "$work/hyperelastic" \
    "$results/soft_vessel_push_hyperelastic.csv" bodies.aorta.motion=hyperelastic bodies.aorta.mesh.element=T10 \
    bodies.aorta.mesh.around=16 bodies.aorta.mesh.along=60 bodies.aorta.mesh.through=1
gnuplot -e "table='$results/soft_vessel_push_hyperelastic.csv'; plot_file='$results/soft_vessel_push_hyperelastic.svg'" \
    validation/studies/soft-vessel/plot.gp
