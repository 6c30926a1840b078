#!/usr/bin/env bash
# Installs what is missing, builds dlod (Release, in build/) and runs all tests. Can be run again at any time.
# usage: tools/test.sh [--sanitizers] [CTEST_ARGUMENT...]
#   --sanitizers   afterwards the tests of core and driver under AddressSanitizer with UndefinedBehaviorSanitizer, and
#                  those of the pipeline under ThreadSanitizer
# Further arguments go to ctest: tools/test.sh -R tracking
set -euo pipefail
cd "$(dirname "$0")/.."

sanitizers=no
if [[ ${1:-} == --sanitizers ]]; then
    sanitizers=yes
    shift
fi
tools/install-deps.sh
tools/install-deps.sh --package || echo "test.sh: the tests of the package that need these are skipped" >&2

step() { printf '\n== %s (%d s since the start)\n' "$*" "$SECONDS"; }
jobs=$(tools/build-jobs.sh)

step "configure and build (Release), $jobs jobs"
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DDLOD_BUILD_BENCHMARKS=ON
cmake --build build -j "$jobs"
step "tests"
ctest --test-dir build -j 2 --output-on-failure "$@"

# sanitize NAME FLAGS TARGETS TEST_PATTERN: builds the targets in build-NAME and runs the tests whose names match.
sanitize() {
    step "$1 sanitizer: build"
    # Little optimisation compiles fast and keeps stacks readable; asserts are on.
    cmake -S . -B "build-$1" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O1 -g1" \
        -DDLOD_SANITIZE="$2" -DDLOD_BUILD_TOOLS=OFF
    # shellcheck disable=SC2086  # several targets
    cmake --build "build-$1" -j "$jobs" --target $3
    step "$1 sanitizer: tests"
    ctest --test-dir "build-$1" -j 2 --output-on-failure -R "$4"
}
if [[ $sanitizers == yes ]]; then
    sanitize address address,undefined "tests_core tests_driver" '^(core_|driver/)'
    sanitize thread thread test_daemon_pipeline '^daemon_pipeline/'
fi

step "all tests passed"
