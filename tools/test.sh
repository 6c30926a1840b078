#!/usr/bin/env bash
# Installs what is missing, builds dlod (Release, in build/) and runs all tests. Can be run again at any time.
# usage: tools/test.sh [--sanitizers] [CTEST_ARGUMENT...]
#   --sanitizers   afterwards the tests once more under AddressSanitizer with UndefinedBehaviorSanitizer, and the threaded
#                  ones under ThreadSanitizer
# Further arguments go to ctest: tools/test.sh -R tracking
set -euo pipefail
cd "$(dirname "$0")/.."

sanitizers=no
if [[ ${1:-} == --sanitizers ]]; then
    sanitizers=yes
    shift
fi
tools/install-deps.sh

step() { printf '\n== %s (%d s since the start)\n' "$*" "$SECONDS"; }
jobs=$(tools/build-jobs.sh)

step "configure and build (Release), $jobs jobs"
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DDLOD_BUILD_BENCHMARKS=ON
cmake --build build -j "$jobs"
step "tests"
ctest --test-dir build -j 2 --output-on-failure "$@"

# sanitize NAME FLAGS TEST_PATTERN: builds the tests in build-NAME and runs those whose names match.
sanitize() {
    step "$1 sanitizer: build"
    cmake -S . -B "build-$1" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DDLOD_SANITIZE="$2" -DDLOD_BUILD_TOOLS=OFF
    cmake --build "build-$1" -j "$jobs"
    step "$1 sanitizer: tests"
    ctest --test-dir "build-$1" -j 2 --output-on-failure -R "$3"
}
if [[ $sanitizers == yes ]]; then
    sanitize address address,undefined '^(core|driver)'
    sanitize thread thread '^daemon'
fi

step "all tests passed"
