#!/usr/bin/env bash
# Scores of the moving objects on simulated drives: five scenes, several seeds each, within 25 m. Prints a Markdown table,
# a row a scene: mean and worst over its seeds.
# usage: tools/scenes_table.sh [--seeds 5] [--frames 100] [--scenes "square corridor street circle slope"] [--keep FOLDER]
#   --keep    where the drives stay, to be used again; else they go when their scores are known
# The street is driven at 5 m/s, the robot of the circle stands, all others walk at 1 m/s.
# Needs a build in build/, or in the folder that BUILD_DIR names.
set -euo pipefail
seeds=5 frames=100 scenes='square corridor street circle slope' keep=''
. "$(dirname "$0")/simulated_drives.sh" "seeds frames scenes keep" "$@"

# The metrics in the order of the columns; a minus: the largest is the worst.
metrics='iou precision recall mota idf1 -id_switches -delay_frames_median -delay_frames_p90 -ghost_pct kept_pct'

# Appends a line of the metrics of one replay; the scores to 50 m, which come later, are left out.
score() {  # DRIVE SCENE
    "$build/daemon/dlod" replay "$1.pcap" --set log.level=error --out "$work/run" >/dev/null
    "$build/tools/eval/dlod-eval" "$1_truth" "$work/run" --json | awk -v metrics="$metrics" '
        /":/ { gsub(/[",:]/, ""); if (!($1 in value)) value[$1] = $2 }
        END { n = split(metrics, m, " "); for (i = 1; i <= n; ++i) { sub(/^-/, "", m[i]); printf "%s ", value[m[i]] } print "" }
    ' >>"$work/$2"
}

# "mean / worst" of each column of the lines on the standard input
row() {  # NAME
    awk -v metrics="$metrics" -v name="$1" '
        BEGIN { n = split(metrics, m, " ") }
        {
            for (i = 1; i <= n; ++i) {
                if ($i == "null") continue
                falls = m[i] ~ /^-/
                if (!count[i] || (falls ? $i > worst[i] : $i < worst[i])) worst[i] = $i
                sum[i] += $i; ++count[i]
            }
        }
        END {
            printf "| %s |", name
            for (i = 1; i <= n; ++i) printf (count[i] ? " %.3g / %.3g |" : " |"), sum[i] / (count[i] ? count[i] : 1), worst[i]
            print ""
        }'
}

echo "| scene, $seeds seeds, $frames frames: mean / worst | IoU | precision | recall | MOTA | IDF1 | switches | delay median | delay p90 | ghosts % | kept % |"
echo '|---|---|---|---|---|---|---|---|---|---|---|'
for scene in $scenes; do
    case $scene in street) speed=5 ;; circle) speed=0 ;; *) speed=1 ;; esac
    for ((seed = 1; seed <= seeds; ++seed)); do
        name=$scene$seed
        make_drive "$name" "$scene" --seed "$seed" --speed "$speed" --frames "$frames"
        score "$drives/$name" "$scene"
        drop_drive "$name"
    done
    row "$scene" <"$work/$scene"
    cat "$work/$scene" >>"$work/all"
done
row all <"$work/all"
