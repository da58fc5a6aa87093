#!/bin/sh
# Which branch does the tip enter for which twist? A table over twists of the base.
# sweep.sh [DEGREES ...]   (default: 0 90 180 270); AMONTONS names the program.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
program=${AMONTONS:-$here/../../build/release/bin/amontons}
out=${OUTPUT:-out/catheter-sweep}
[ $# -gt 0 ] || set -- 0 90 180 270
mkdir -p "$out"

value() { sed -n "s/^ *\"$1\": \"*\([^\",]*\)\"*,*\$/\1/p" "$2" | head -n 1; }

printf '%-9s %-16s %12s %12s %12s %9s\n' 'twist' 'branch' 'depth [mm]' 'push [N]' 'torque [mNm]' 'passed'
for degrees in "$@"; do
    radians=$(awk "BEGIN {printf \"%.15g\", $degrees * 3.141592653589793 / 180}")
    "$program" run "$here/scene.json" --output "$out/$degrees" --json --quiet \
        --set "bodies.wire.drive.twist=[[7.5,0],[9.5,$radians]]" \
        --set output.picture=false --set output.plots=false >"$out/$degrees.json"
    branch=$(value branch "$out/$degrees.json")
    awk -v a="$degrees" -v b="${branch:-none}" -v d="$(value max_depth "$out/$degrees.json")" \
        -v f="$(value max_push_force "$out/$degrees.json")" \
        -v t="$(value max_torque "$out/$degrees.json")" \
        -v p="$(value passed_through "$out/$degrees.json")" \
        'BEGIN {printf "%-9s %-16s %12.1f %12.4f %12.4f %9d\n", a, b, 1e3 * d, f, 1e3 * t, p}'
done
