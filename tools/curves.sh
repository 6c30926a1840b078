#!/usr/bin/env bash
# IoU, precision and recall of the dynamic mask over the residual threshold of the paper's rule (theta_res of Eq. 6, no
# other cue) and over the evidence threshold of all cues together: tables (CSV) and plots (SVG).
# usage: tools/curves.sh PCAP TRUTH_DIR [OUTPUT_FOLDER]     (default: out/curves)
# Needs a build in build/, or in the folder that BUILD_DIR names.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=${BUILD_DIR:-$here/../build}
[[ $# -ge 2 ]] || { sed -n '2,5s/^# //p' "$0"; exit 2; }
pcap=$1 truth=$2 out=${3:-out/curves}
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

curve() {  # NAME KEY LABEL "VALUE..." ARGUMENT...
    local name=$1 key=$2 label=$3 values=$4 value
    shift 4
    echo "$key,iou,precision,recall" >"$out/$name.csv"
    for value in $values; do
        "$build/daemon/dlod" replay "$pcap" "$@" --set "$key=$value" --set log.level=error --out "$work/run" >/dev/null
        "$build/tools/eval/dlod-eval" "$truth" "$work/run" | awk -v v="$value" '
            /^masks:/ { for (i = 2; i <= NF; i++) { split($i, f, "="); m[f[1]] = f[2] }
                        print v "," m["iou"] "," m["precision"] "," m["recall"] }' | tee -a "$out/$name.csv"
    done
    gnuplot -e "data='$out/$name.csv'; label='$label'; out='$out/$name.svg'" "$here/report/curves.gp"
}

echo "over the residual threshold (residual alone, as in the paper):"
curve residual_threshold tracking.state.theta_res 'residual threshold theta_res' '0.05 0.1 0.15 0.2 0.3 0.4 0.6 0.8' \
    --set detection.use_free_space=false --set tracking.state.use_free_space=false --set tracking.state.use_displacement=false
echo "over the evidence threshold (all cues):"
curve evidence_threshold tracking.state.dynamic_log_odds 'log-odds at which a track is dynamic' '0.5 1 1.5 2 2.6 3.2 4 5 6 7'
echo "written: $out/residual_threshold.csv, .svg and $out/evidence_threshold.csv, .svg"
