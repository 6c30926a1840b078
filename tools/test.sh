#!/usr/bin/env bash
# Installs what is missing, builds dlod (Release, in build/) and runs all tests. Can be run again at any time.
# usage: tools/test.sh [--sanitizers | --thread-sanitizer] [CTEST_ARGUMENT...]
#   --thread-sanitizer   afterwards the pipeline and the whole program, live and in replay, under ThreadSanitizer
#   --sanitizers         that, and all tests under AddressSanitizer with UndefinedBehaviorSanitizer
# Further arguments go to ctest: tools/test.sh -R tracking
set -euo pipefail
case ${1:-} in --help|-h) sed -n '2,6s/^# //p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/.."

sanitizers=()
case ${1:-} in
    --sanitizers) sanitizers=(thread address) ;;
    --thread-sanitizer) sanitizers=(thread) ;;
esac
((${#sanitizers[@]} == 0)) || shift
tools/install-deps.sh
tools/install-deps.sh --package || echo "test.sh: the tests of the package that need these are skipped" >&2

step() { printf '\n== %s (%d s since the start)\n' "$*" "$SECONDS"; }
jobs=$(tools/build-jobs.sh)

step "configure and build (Release), $jobs jobs"
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DDLOD_BUILD_TESTS=ON -DDLOD_BUILD_BENCHMARKS=ON
cmake --build build -j "$jobs"
step "tests"
ctest --test-dir build -j 2 --output-on-failure "$@"

# sanitize NAME FLAGS TOOLS TARGETS TEST_PATTERN: builds the targets in build-NAME and runs the tests whose names match.
sanitize() {
    step "$1 sanitizer: build"
    # Little optimisation compiles fast and keeps stacks readable; asserts are on. The simulator that sends packets in
    # time is the fast one.
    cmake -S . -B "build-$1" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O1 -g1" \
        -DDLOD_SANITIZE="$2" -DDLOD_BUILD_TOOLS="$3" -DDLOD_SIM_BINARY="$PWD/build/tools/sim/dlod-sim"
    # shellcheck disable=SC2086  # several targets
    cmake --build "build-$1" -j "$jobs" --target $4
    step "$1 sanitizer: tests"
    TSAN_OPTIONS=suppressions=$PWD/tests/support/thread_sanitizer.supp \
        ctest --test-dir "build-$1" -j 2 --output-on-failure -R "$5"
}
for sanitizer in "${sanitizers[@]}"; do
    case $sanitizer in
        thread) sanitize thread thread OFF "test_daemon_pipeline test_daemon_publish test_daemon_live" \
            '^daemon_(pipeline|publish|live)/' ;;
        address) sanitize address address,undefined ON "tests_core tests_driver tests_daemon tests_tools" '/' ;;
    esac
done

step "all tests passed"
