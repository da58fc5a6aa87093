#!/usr/bin/env bash
# Feeds damaged files to every reader of outside data (libFuzzer, ASan, UBSan).
#   validation/fuzz.sh [SECONDS_PER_TARGET=10] [TARGET...]
# Exit 1 if a reader crashed, hung or took too much memory: the input that did it is then in
# build/fuzz/crashes/, and the last line specifies how to run it again.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-10}
shift || true
if ! [[ $seconds =~ ^[0-9]+$ ]]; then
    echo "fuzz.sh: found seconds per target \"$seconds\", allowed: a whole number" >&2
    exit 2
fi
if ! command -v clang++ >/dev/null; then
    echo "fuzz.sh: clang++ is not installed (packages clang and libclang-rt-dev)" >&2
    exit 1
fi

build=build/fuzz
launcher=$(command -v ccache || true)
log=$build.log
mkdir -p build
if ! { cmake --preset fuzz -DCMAKE_CXX_COMPILER_LAUNCHER="$launcher" &&
       cmake --build --preset fuzz; } >"$log" 2>&1; then
    tail -n 40 "$log" >&2
    echo "fuzz.sh: the fuzz targets do not build; the whole log is $log" >&2
    exit 1
fi

mapfile -t all < <(ls $build/fuzzers)
targets=("${@:-${all[@]}}")
for target in "${targets[@]}"; do
    if [[ ! -f $build/fuzzers/$target ]]; then
        echo "fuzz.sh: found target \"$target\", allowed: ${all[*]}" >&2
        exit 2
    fi
done
mkdir -p $build/crashes
failed=()
for target in "${targets[@]}"; do
    { read -r program; read -r seeds; } <$build/fuzzers/"$target"
    mkdir -p $build/corpus/"$target" # new inputs are kept here; later runs continue from them
    if "$program" -max_total_time="$seconds" -timeout=10 \
        -rss_limit_mb=2048 -malloc_limit_mb=256 -print_final_stats=1 \
        -artifact_prefix=$build/crashes/"$target"- \
        $build/corpus/"$target" "$seeds" >$build/"$target".log 2>&1; then
        runs=$(sed -n 's/^stat::number_of_executed_units: *//p' $build/"$target".log)
        echo "$target: $runs inputs in $seconds s, no crash"
    else
        failed+=("$target")
        tail -n 60 $build/"$target".log >&2
        echo "$target: FAILED; again with: $program $(sed -n 's/.*Test unit written to //p' $build/"$target".log)" >&2
    fi
done
[[ ${#failed[@]} == 0 ]]
