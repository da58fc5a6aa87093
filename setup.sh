#!/usr/bin/env bash
# amontons from a clone to its results, on Debian 12 and 13 and Ubuntu 24.04. See ./setup.sh help.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

# ---- the only list of packages; all are in Debian 12, Debian 13 and Ubuntu 24.04

build=(g++ cmake ninja-build ccache)
core=(libeigen3-dev libxxhash-dev libmetis-dev zlib1g-dev nlohmann-json3-dev libcli11-dev libfmt-dev
    libsuitesparse-dev libopenblas0) # without OpenBLAS the reference BLAS factors, many times slower
pictures=(libvtk9-dev libx11-dev xvfb gnuplot-nox)    # the VTK module and the plots
modules=(petsc-dev openmpi-bin libcgal-dev libfclib-dev libspnav-dev) # large systems, meshing, contact problems in files, a 3D mouse
bindings=(python3-dev python3-numpy pybind11-dev)                      # the package amontons of Python
studio=(libcpp-httplib-dev)                                            # the page of amontons studio
command -v npm >/dev/null || studio+=(nodejs npm)                      # one from elsewhere may not stand beside Debian's
browser=(chromium)                                                     # its tests
tests=(doctest-dev libbenchmark-dev python3 python3-jsonschema python3-scipy python3-h5py mypy clang libclang-rt-dev shellcheck)

# ---- where things are

program=build/release/bin/amontons
scene=examples/catheter
results=out/catheter

# Minutes of processor time from nothing, on the machine of docs/build.md.
demo_minutes=13
all_minutes=6
test_minutes=23
fuzz_minutes=4

usage() {
    cat <<'END'
usage: ./setup.sh COMMAND

  demo       installs what the demo lacks, builds the program, pushes a guidewire through an
             aortic arch and prints what came out; does nothing twice
  all        builds the rest: "amontons study" and "validate", the modules for contact
             problems in files (fclib), meshing (cgal) and large solids (petsc), the page
             of "amontons studio", and the package amontons of Python
  install [--prefix P]   does all, and puts program, modules, completion and package below P
             (/usr/local as root, else ~/.local), where shell and python3 find them
  test       does all, then builds and runs the whole test suite
  test --all the same with the tests that take minutes each
  packages   only installs: all packages, of the tests and of every module
  help       this text

Packages come from apt, as root or with sudo. On a terminal it requires one confirmation before it installs.
Nothing is compiled twice; docs/build.md states the cost of each part.
END
}

message() { printf '%s\n' "$*"; }
fail() {
    printf 'setup.sh: %s\n' "$*" >&2
    exit 1
}

# ---- packages

is_installed() { [[ "$(dpkg-query -W -f '${db:Status-Abbrev}' "$1" 2>/dev/null)" == "ii "* ]]; }
is_known() { [[ -n "$(apt-cache show --no-all-versions "$1" 2>/dev/null)" ]]; }

as_root() {
    if [[ $EUID -eq 0 ]]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        fail "installing needs root or sudo: $*"
    fi
}

# lacking PACKAGE...: prints those that are not installed.
lacking() {
    local name
    for name in "$@"; do
        is_installed "$name" || message "$name"
    done
}

# install REQUIRED... -- OPTIONAL...
install_packages() {
    local -a required=() optional=()
    local entry target=required
    for entry in "$@"; do
        if [[ $entry == -- ]]; then
            target=optional
        elif [[ $target == required ]]; then
            required+=("$entry")
        else
            optional+=("$entry")
        fi
    done
    if ! command -v dpkg-query apt-get >/dev/null; then
        message "No apt here; it is up to you to have what these packages hold: ${required[*]}"
        return
    fi

    local -a needed missing
    mapfile -t needed < <(lacking "${required[@]}")
    mapfile -t missing < <(lacking "${optional[@]}")
    [[ $((${#needed[@]} + ${#missing[@]})) -eq 0 ]] && return
    message "To install with apt: ${needed[*]} ${missing[*]}"
    if [[ -t 0 && -t 1 ]]; then
        local answer
        read -r -p "Continue? [Y/n] " answer
        [[ -z $answer || $answer == [yY]* ]] || fail "nothing installed"
    fi
    if ! as_root apt-get -qq update; then
        [[ ${#needed[@]} -eq 0 ]] || fail "apt-get update failed: no network, or broken sources"
        message "apt-get update failed; continuing without ${missing[*]}"
        return
    fi

    local -a chosen=()
    local name
    for name in "${needed[@]}" "${missing[@]}"; do
        if is_known "$name"; then
            chosen+=("$name")
        elif [[ " ${needed[*]} " == *" $name "* ]]; then
            fail "this release has no package $name, and amontons cannot do without"
        else
            message "This release has no package $name: what needs it is left out."
        fi
    done
    [[ ${#chosen[@]} -eq 0 ]] && return
    mkdir -p build
    message "Installing; this can take minutes. The output of apt is written to build/apt.log."
    if ! as_root env DEBIAN_FRONTEND=noninteractive apt-get -q install -y \
        --no-install-recommends -o Dpkg::Use-Pty=0 "${chosen[@]}" >build/apt.log 2>&1; then
        tail -n 30 build/apt.log >&2
        fail "apt-get install failed"
    fi
}

# ---- build and run

python="" # of the tests; empty: CMake's own choice

configure() {
    local -a more=()
    command -v ccache >/dev/null && more+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
    [[ -n $python ]] && more+=("-DPython3_EXECUTABLE=$python")
    cmake --preset "$1" "${more[@]}"
}

# Several files are compiled at once as one: up to 2 GB for each compiler.
jobs_at_once() {
    local cores memory
    cores="$(nproc)"
    memory="$(awk '/^MemAvailable:/ { print int($2 / 2000000) }' /proc/meminfo)"
    [[ $memory -ge 1 ]] || memory=1
    message $((cores < memory ? cores : memory))
}

# compile PRESET MINUTES WHAT [TARGET...]: states how long it takes from nothing (processor time, measured as
# docs/build.md reports), if anything is left to do.
compile() {
    local preset="$1" minutes="$2" what="$3" at_once
    shift 3
    at_once="$(jobs_at_once)"
    if ! ninja -C "build/$preset" -n "$@" | grep -q 'no work to do'; then
        message "Building $what: about $minutes min of processor time if nothing is compiled yet," \
            "$(((minutes + at_once - 1) / at_once)) min with $at_once at a time."
    fi
    cmake --build --preset "$preset" -j "$at_once" ${@:+--target "$@"}
}

files_ending_in() { find "$results" -maxdepth 1 -name "*.$1" -printf '  %p\n' | sort; }

# All that the results depend on is older than they are, and they are of a finished run.
results_are_current() {
    [[ -s $results/manifest.json && -s $results/summary.txt ]] || return 1
    grep -q '"status": *"done"' "$results/manifest.json" || return 1
    [[ -z "$(find "$scene" "$program" build/release/lib -type f \
        -newer "$results/manifest.json" -print -quit)" ]]
}

run_demo() {
    if results_are_current; then
        message "$results is newer than the program and $scene/scene.json: not run again."
        cat "$results/summary.txt"
    else
        local table status=0
        table="$(mktemp)"
        "$program" run "$scene/scene.json" --output "$results" | tee "$table" || status=$?
        if [[ $status -ne 0 ]]; then
            rm -f "$table"
            message "setup.sh: the run of $scene/scene.json ended with exit code $status" >&2
            exit "$status"
        fi
        cat "$table" >"$results/summary.txt"
        rm -f "$table"
    fi
    message
    message "Pictures and plots:"
    files_ending_in png
    files_ending_in svg
    message "VTK files for ParaView:"
    files_ending_in pvd
    message "All numbers:"
    files_ending_in csv
    files_ending_in json
}

# What the page is bundled from, by the lock file and without the scripts of others: once, and when the lock changes.
fetch_page() {
    [[ web/node_modules/.package-lock.json -nt web/package-lock.json ]] && return
    if ! command -v npm >/dev/null; then
        message "No npm: amontons studio is left out."
        return
    fi
    message "Fetching what the page of amontons studio is made of (npm ci --ignore-scripts in web/)."
    (cd web && npm ci --ignore-scripts --no-audit --no-fund >../build/npm.log 2>&1) || {
        tail -n 5 build/npm.log >&2
        message "npm ci failed, see build/npm.log: amontons studio is left out."
        rm -rf web/node_modules
    }
}

demo() {
    configure release
    compile release "$demo_minutes" "the program" demo
    run_demo
    message
    message "The program is $PWD/$program. What to try next:"
    message "  $program run examples/first_block/scene.json    a soft ball falls on a plate"
    message "  $program check examples/catheter/scene.json     what the program makes of a scene"
    message "  ./setup.sh install                              the command amontons, with everything:" \
        "about $all_minutes min more of processor time"
}

build_all() {
    mkdir -p build
    fetch_page
    configure release
    compile release $((demo_minutes + all_minutes)) "the program, studies and cases, all modules and the package of Python" demo all_programs
}

install_program() {
    local prefix="$1" folder
    build_all
    mkdir -p build
    cmake --install build/release --prefix "$prefix" >build/install.log || fail "installing failed, see build/install.log"
    folder="$(cd "$prefix" && pwd)"
    message "Installed: $folder/bin/amontons, its modules in $folder/lib*, completion for bash in $folder/share."
    case ":$PATH:" in
    *":$folder/bin:"*) ;;
    *) message "The shell does not search there yet: add  export PATH=\"$folder/bin:\$PATH\"  to your ~/.bashrc" ;;
    esac
    report_package "$folder"
}

# Of the package of Python below a prefix, and whether the python3 that it was built for searches there.
report_package() {
    local package site interpreter
    package="$(find "$1/lib" -path '*-packages/amontons/__init__.py' -print -quit 2>/dev/null)"
    if [[ -z $package ]]; then
        message "The package amontons of Python was left out: cmake --preset release states what it lacks."
        return
    fi
    site="${package%/amontons/__init__.py}"
    interpreter="$(sed -n 's/^AMONTONS_PYTHON_PROGRAM:[A-Z]*=//p' build/release/CMakeCache.txt)"
    if "$interpreter" -c 'import sys; sys.exit(sys.argv[1] not in sys.path)' "$site"; then
        message "$interpreter finds the package amontons in $site."
    else
        message "$interpreter does not search $site, where the package amontons is:" \
            "add  export PYTHONPATH=\"$site\"  to your ~/.bashrc"
    fi
}

# A test that lacks its tool would be left out in silence, and the suite would seem green.
check_tools() {
    local -a missing=()
    local name
    for name in cmake ninja c++ clang++ shellcheck gnuplot Xvfb; do
        command -v "$name" >/dev/null || missing+=("$name")
    done
    for name in python3 /usr/bin/python3; do # the first on the path may not be the one of apt
        if "$name" -c 'import jsonschema' 2>/dev/null; then
            python="$(command -v "$name")"
            break
        fi
    done
    [[ -n $python ]] || missing+=("python3 with jsonschema")
    [[ ${#missing[@]} -eq 0 ]] || fail "the tests need what is not here: $(
        printf '%s, ' "${missing[@]}" | sed 's/, $//')"
}

# run_tests FOLDER [CTEST ARGUMENT...]: adds to `passed` and `failed`.
run_tests() {
    local folder="$1" log line
    shift
    log="$(mktemp)"
    ctest --test-dir "$folder" --output-on-failure --no-tests=error -j 2 "$@" | tee "$log" || true
    line="$(grep -E '% tests passed, [0-9]+ tests? failed out of [0-9]+' "$log" || true)"
    rm -f "$log"
    if [[ $line =~ ([0-9]+)\ tests?\ failed\ out\ of\ ([0-9]+) ]]; then
        failed=$((failed + BASH_REMATCH[1]))
        passed=$((passed + BASH_REMATCH[2] - BASH_REMATCH[1]))
    else
        message "No tests ran in $folder."
        failed=$((failed + 1))
    fi
}

run_suite() {
    passed=0
    failed=0
    compile release "$test_minutes" "everything and its tests"
    compgen -G "build/release/lib/*/libamontons-vtk.so" >/dev/null ||
        fail "the module vtk was not built (libvtk9-dev, libx11-dev), and its tests with it"
    run_tests build/release "$@"
    configure fuzz
    compile fuzz "$fuzz_minutes" "the readers with sanitizers, to be fuzzed" fuzz
    run_tests build/fuzz -L fuzz
    message "$passed passed, $failed failed"
    [[ $failed -eq 0 && $passed -gt 0 ]]
}

command="${1:-help}"
[[ $# -eq 0 ]] || shift
option=""
case "$command $*" in
"test --all") option=all ;;
"install --prefix "?*) option="${*:2}" ;;
*" ") ;;
*)
    usage >&2
    fail "$command: found \"$*\", allowed: $(
        case "$command" in
        test) message "nothing, or --all" ;;
        install) message "nothing, or --prefix FOLDER" ;;
        *) message "nothing" ;;
        esac
    )"
    ;;
esac

case "$command" in
packages)
    install_packages "${build[@]}" "${core[@]}" -- "${pictures[@]}" "${modules[@]}" "${bindings[@]}" "${studio[@]}" "${browser[@]}" "${tests[@]}"
    message "All packages are installed."
    ;;
demo)
    install_packages "${build[@]}" "${core[@]}" "${pictures[@]}"
    demo
    ;;
all)
    install_packages "${build[@]}" "${core[@]}" "${pictures[@]}" -- "${modules[@]}" "${bindings[@]}" "${studio[@]}"
    build_all
    ;;
install)
    install_packages "${build[@]}" "${core[@]}" "${pictures[@]}" -- "${modules[@]}" "${bindings[@]}" "${studio[@]}"
    if [[ -z $option ]]; then
        option=/usr/local
        [[ $EUID -eq 0 ]] || option="$HOME/.local"
    fi
    install_program "$option"
    ;;
test)
    install_packages "${build[@]}" "${core[@]}" "${pictures[@]}" "${tests[@]}" -- "${modules[@]}" "${bindings[@]}" "${studio[@]}" "${browser[@]}"
    check_tools
    mkdir -p build
    fetch_page
    demo
    if [[ $option == all ]]; then run_suite; else run_suite -LE long; fi
    ;;
help | --help | -h)
    usage
    ;;
*)
    usage >&2
    fail "unknown command: $command"
    ;;
esac
