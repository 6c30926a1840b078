#!/usr/bin/env bash
# usage: tests/fuzz/run.sh [SECONDS] [FUZZER...]
# Builds the fuzzers with clang, runs each for SECONDS (default 60) from small seeds, and prints the number of inputs.
# Corpora stay in build-fuzz/corpus and are taken up by the next run; an input that fails is left in build-fuzz.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
shift || true
build=build-fuzz

cmake -S . -B $build -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_BUILD_TYPE=Release \
    -DDLOD_BUILD_FUZZERS=ON -DDLOD_BUILD_TESTS=OFF -DDLOD_BUILD_TOOLS=OFF -DDLOD_WERROR=OFF >/dev/null
fuzzers=("$@")
if [ ${#fuzzers[@]} -eq 0 ]; then
    for source in tests/fuzz/*_fuzzer.cpp; do fuzzers+=("$(basename "$source" _fuzzer.cpp)"); done
fi
ninja -C $build fuzz_seeds "${fuzzers[@]/%/_fuzzer}"
$build/tests/fuzz/fuzz_seeds $build/seeds

failed=0
for fuzzer in "${fuzzers[@]}"; do
    mkdir -p "$build/corpus/$fuzzer" "$build/seeds/$fuzzer"
    log=$build/$fuzzer.log
    longest=16384
    # Each byte of these is worth many of the others': more inputs find more than longer ones.
    case $fuzzer in packets | config) longest=2048 ;; esac
    if $build/tests/fuzz/"${fuzzer}_fuzzer" -max_total_time="$seconds" -max_len="$longest" -print_final_stats=1 \
        -artifact_prefix="$build/$fuzzer-" "$build/corpus/$fuzzer" "$build/seeds/$fuzzer" >"$log" 2>&1; then
        outcome="no fault"
    else
        outcome="FAULT, see $log"
        failed=1
    fi
    inputs=$(awk '/stat::number_of_executed_units/ { print $2 }' "$log")
    printf '%-12s %10s inputs in %s s: %s\n' "$fuzzer" "${inputs:-?}" "$seconds" "$outcome"
done
exit $failed
