#!/usr/bin/env bash
# Measures dlod on a capture: elapsed and CPU milliseconds a frame by step, allocations a frame, peak memory, frames a
# second. Prints a table in markdown.
# usage: tools/bench.sh PCAP [--kernels] [REPLAY_ARGUMENT...]
#   --kernels   also the kernels one by one (Google Benchmark; needs a build with -DDLOD_BUILD_BENCHMARKS=ON, which
#               tools/test.sh makes)
# Needs a build of everything (tools/test.sh makes it) in build/, or in the folder that BUILD_DIR names. Run it on an idle
# machine.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=${BUILD_DIR:-$here/../build}
[[ $# -ge 1 && $1 != -* ]] || { sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 2; }
pcap=$1
shift
counter=$build/tools/bench/liballocation_counter.so
[[ -f $counter ]] || { echo "bench: $counter is not there: cmake --build $build" >&2; exit 1; }
kernels=no
if [[ ${1:-} == --kernels ]]; then
    kernels=yes
    shift
fi
[[ " $* " == *" --metadata "* ]] || set -- --metadata "${pcap%.*}.json" "$@"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

replay() {  # CAPTURE ARGUMENT...
    "$build/daemon/dlod" replay "$@" --set log.level=error >"$work/summary"
}
mean_of_steps() {  # frames.csv: one "step mean" a line, and their total
    awk -F, 'NR == 1 { for (i = 9; i <= NF; i++) name[i] = $i; next }
             { for (i = 9; i <= NF; i++) sum[i] += $i }
             END { for (i = 9; i <= NF; i++) { sub(/_ms$/, "", name[i]); m = sum[i] / (NR - 1); total += m; print name[i], m }
                   print "total", total }' "$1"
}

replay "$pcap" "$@" --threads 1 --set output.timing=wall --out "$work/wall"
replay "$pcap" "$@" --threads 1 --set output.timing=cpu --out "$work/cpu"
echo "| step | elapsed ms a frame | CPU ms a frame |"
echo "|---|---|---|"
paste -d' ' <(mean_of_steps "$work/wall/frames.csv") <(mean_of_steps "$work/cpu/frames.csv") |
    awk '{ printf "| %s | %.2f | %.2f |\n", $1, $2, $4 }'
echo

# Without output files, as on a robot; the whole capture and its first half: their difference is the steady state.
head -c $(($(stat -c %s "$pcap") / 2)) "$pcap" >"$work/half.pcap"
counted() {  # CAPTURE: "allocations bytes peak_kB frames"
    rm -f "$work/allocations"
    DLOD_ALLOCATION_REPORT=$work/allocations LD_PRELOAD=$counter replay "$@"
    echo "$(tail -n 1 "$work/allocations") $(awk '/ frames,/ { print $1; exit }' "$work/summary")"
}
read -r all_count all_bytes all_peak all_frames < <(counted "$pcap" "$@" --threads 1)
read -r half_count half_bytes _ half_frames < <(counted "$work/half.pcap" "$@" --threads 1)
echo "| | |"
echo "|---|---|"
frames=$((all_frames - half_frames))
awk -v n="$frames" -v c=$((all_count - half_count)) -v b=$((all_bytes - half_bytes)) \
    'BEGIN { printf "| allocations a frame, second half of the capture | %.1f (%.0f kB) |\n", c / n, b / n / 1000 }'
echo "| peak memory | $((all_peak / 1000)) MB |"
for threads in 1 2; do
    replay "$pcap" "$@" --threads $threads
    echo "| replay on $threads thread(s), no output files | $(grep -oE '[0-9.]+ frames/s' "$work/summary" | head -1) |"
done

if [[ $kernels == yes ]]; then
    echo
    "$build/tools/bench_kernels/dlod-bench-kernels" --benchmark_counters_tabular=true
fi
