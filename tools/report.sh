#!/usr/bin/env bash
# Reports on a replay: the paper's table of processing time, plots over the frames, scores against truth, and the run
# from above with the handling of dynamic objects on and off (off is plain two-stage odometry).
# usage: tools/report.sh RUN [--pcap FILE [--metadata FILE]] [--truth DIR] [--out DIR] [-c FILE] [--set KEY=VALUE]...
#   RUN         output folder of `dlod replay`; with --pcap it is made when it is not there, on one thread, and its
#               times are CPU times
#   --pcap      the capture; needed for the comparison on and off and for the pictures of a frame
#   --out       where report.md, plots and pictures go; default: RUN/../report
# Needs a build (tools/test.sh or tools/demo.sh make it) in build/, or in the folder that BUILD_DIR names.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=${BUILD_DIR:-$here/../build}

run='' pcap='' truth='' out=''
metadata=() config=()
while [[ $# -gt 0 ]]; do
    case $1 in
        --pcap) pcap=$2; shift 2 ;;
        --metadata) metadata=(--metadata "$2"); shift 2 ;;
        --truth) truth=$2; shift 2 ;;
        --out) out=$2; shift 2 ;;
        -c|--set) config+=("$1" "$2"); shift 2 ;;
        -*) sed -n '2,10s/^# \{0,1\}//p' "$0"; exit 2 ;;
        *) run=$1; shift ;;
    esac
done
[[ -n $run ]] || { sed -n '2,10s/^# \{0,1\}//p' "$0"; exit 2; }
out=${out:-$(dirname "$run")/report}
mkdir -p "$out"

replay() {  # OUTPUT_FOLDER ARGUMENT...
    "$build/daemon/dlod" replay "$pcap" "${metadata[@]}" "${config[@]}" --threads 1 --set output.timing=cpu \
        --set log.level=warning --out "$@" >/dev/null
}
evaluate() {  # OUTPUT_FOLDER ARGUMENT...
    "$build/tools/eval/dlod-eval" "$truth" "$@"
}

if [[ ! -e $run/frames.csv ]]; then
    [[ -n $pcap ]] || { echo "report: $run is no output folder of dlod replay; with --pcap FILE it is made" >&2; exit 1; }
    echo "replaying $pcap"
    replay "$run"
fi
errors=
if [[ -n $truth ]]; then
    errors=$out/trajectory_error.csv
    scores_on=$(evaluate "$run" --errors "$errors")
fi
draw=("$build/tools/draw/dlod-draw" "$run" --out "$out" --title "handling of dynamic objects: on")
[[ -n $truth ]] && draw+=(--truth "$truth")
if [[ -n $pcap ]]; then
    echo "replaying with the handling of dynamic objects off"
    replay "$out/off" --set handle_dynamic_objects=false
    [[ -n $truth ]] && scores_off=$(evaluate "$out/off" | grep -E '^(trajectory|map)')
    draw+=(--pcap "$pcap" "${metadata[@]}" "${config[@]}" --beside "$out/off" --beside-title "handling of dynamic objects: off")
fi
"${draw[@]}" >/dev/null
gnuplot -e "run='$run'; out='$out'; errors='$errors'" "$here/report/plots.gp"

{
    echo "# Replay $(basename "$run")"
    echo
    echo "Milliseconds a frame over $(($(wc -l <"$run/frames.csv") - 1)) frames, mean ± standard deviation."
    echo
    awk -F, -f "$here/report/stage_table.awk" "$run/frames.csv"
    echo
    echo "![milliseconds](milliseconds.svg)"
    if [[ -n $truth ]]; then
        printf '\nScores against truth:\n\n```\n%s\n```\n' "$scores_on"
        [[ -n $pcap ]] && printf '\nWith the handling of dynamic objects off:\n\n```\n%s\n```\n' "$scores_off"
        printf '\n![pose error](trajectory_error.svg)\n'
    fi
    [[ -n $pcap ]] && printf '\n![range image](range_image.png)\n![residual image](residual_image.png)\n'
    printf '\n![from above](from_above.png)\n'
} >"$out/report.md"

grep -v '^!\[' "$out/report.md"
echo "written: $out/report.md, plots (svg) and pictures (png) beside it"
