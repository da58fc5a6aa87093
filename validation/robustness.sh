#!/usr/bin/env bash
# Faults, sanitizers and fuzzing under one command, with their counts.
#   validation/robustness.sh [TRIALS=200] [FUZZ_SECONDS=10]
# Needs the release build; builds the presets asan, tsan and fuzz (an hour and a half from nothing, on
# two cores). Ends with a table; exit 1 if anything failed. Logs: build/robustness/.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 2
trials=${1:-200}
seconds=${2:-10}
if ! [[ $trials =~ ^[0-9]+$ && $seconds =~ ^[0-9]+$ ]]; then
    echo "robustness.sh: found \"$*\", allowed: two whole numbers, trials and seconds" >&2
    exit 2
fi
if [[ ! -x build/release/bin/amontons ]]; then
    echo "robustness.sh: no build/release/bin/amontons (cmake --build --preset release)" >&2
    exit 2
fi
logs=build/robustness
mkdir -p $logs
launcher=$(command -v ccache || true)
table=()
failed=0

# note NAME TEXT STATUS
note() {
    table+=("$(printf '%-12s %-60s %s' "$1" "$2" "$([[ $3 == 0 ]] && echo passed || echo FAILED)")")
    [[ $3 == 0 ]] || failed=1
}

validation/faults.py build/release/bin/amontons --trials "$trials" --json $logs/faults.json \
    >$logs/faults.log 2>&1
note faults "$(tail -n 1 $logs/faults.log)" $?

# build_and_test PRESET TESTS NOT_THESE [TARGET...]
build_and_test() {
    local preset=$1 tests=$2 others=$3 log=$logs/$1.log status reports
    shift 3
    if cmake --preset "$preset" -DCMAKE_CXX_COMPILER_LAUNCHER="$launcher" >"$log" 2>&1 &&
        cmake --build --preset "$preset" ${@:+--target "$@"} >>"$log" 2>&1; then
        ctest --test-dir "build/$preset" -j 2 --output-on-failure --no-tests=error -R "$tests" -E "$others" >>"$log" 2>&1
        status=$?
        if [[ $others != none ]]; then
            ASAN_OPTIONS=detect_leaks=0 ctest --test-dir "build/$preset" -j 2 --output-on-failure -R "$others" >>"$log" 2>&1 || status=1
        fi
        reports=$(grep -cE 'ERROR: AddressSanitizer|runtime error:|WARNING: ThreadSanitizer' "$log")
        [[ $reports == 0 ]] || status=1
        note "$preset" "$(grep -oE '[0-9]+% tests passed, .*' "$log" | paste -sd ';'); $reports reports" $status
    else
        note "$preset" "does not build, see $log" 1
    fi
}
# OpenMPI and the drivers of OpenGL leave memory behind when they end.
build_and_test asan . '^(large|vtk|view)'
# What has threads of its own. GCC's OpenMP is not compiled for the sanitizer, which sees races where
# its barriers are.
build_and_test tsan '^(haptic|python_sanitized)' none amontons amontons-python haptics_tests haptics_loop_tests haptics_link_tests haptics_real_time_tests

validation/fuzz.sh "$seconds" >$logs/fuzz.log 2>&1
status=$?
inputs=$(sed -n 's/^[a-z_]*: \([0-9]*\) inputs.*/\1/p' $logs/fuzz.log | awk '{ s += $1 } END { print s + 0 }')
note fuzz "$(grep -c ' inputs in ' $logs/fuzz.log) readers, $inputs inputs, $(grep -c FAILED $logs/fuzz.log) crashes" $status

printf '%s\n' "${table[@]}"
exit $failed
