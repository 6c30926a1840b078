#!/usr/bin/env bash
# Scores on simulated drives by size of the sensor, with the presets: product lines, rows, columns and rates, in a square
# at a walking pace and in a street at 5 m/s, moving objects within 25 m, CPU time on one thread. Prints a Markdown
# table, a row a drive.
# usage: tools/sensors_table.sh [--sensors "OS0-128:1024x10 ..."] [--scenes "square street"] [--seed 41] [--frames 100]
#                               [--keep FOLDER]
#   --keep    where the drives stay, to be used again; else they go when their scores are known
# Needs a build in build/, or in the folder that BUILD_DIR names.
set -euo pipefail
sensors='OS0-128:1024x10 OS0-128:2048x10 OS0-128:1024x20 OS0-128:512x20 OS1-64:1024x10 OS1-64:2048x10 OS1-64:1024x20'
sensors+=' OS1-64:512x20 OS0-32:1024x10 OS0-32:1024x20 OS1-32:1024x10 OS1-32:1024x20 OS2-32:1024x10 OS2-32:1024x20'
scenes='square street' seed=41 frames=100 keep=''
. "$(dirname "$0")/simulated_drives.sh" "sensors scenes seed frames keep" "$@"

# CPU milliseconds of a frame in some steps, the median over the frames.
median_ms() {  # STEPS, as a regular expression
    awk -F, -v steps="^($1)_ms\$" '
        NR == 1 { for (i = 9; i <= NF; ++i) counts[i] = $i ~ steps; next }
        { sum = 0; for (i = 9; i <= NF; ++i) sum += counts[i] * $i; print sum }
    ' "$work/run/frames.csv" | sort -n | awk '{ ms[NR] = $1 } END { printf " %.1f |", ms[int((NR + 1) / 2)] }'
}

# The cells of one replay; of the scores those within 25 m, which come first.
score() {  # DRIVE
    "$build/daemon/dlod" replay "$1.pcap" --threads 1 --set output.timing=cpu --set log.level=error \
        --out "$work/run" >/dev/null
    "$build/tools/eval/dlod-eval" "$1_truth" "$work/run" --json | awk '
        /": / { gsub(/[",:]/, ""); if (!($1 in value)) value[$1] = $2 }
        END {
            printf " %.1f | %.0f %% |", 100 * value["ate_m"], 100 * value["poses"] / value["truth_poses"]
            n = split("iou precision recall mota idf1", names, " ")
            for (i = 1; i <= n; ++i) printf " %.3f |", value[names[i]]
        }'
    median_ms '.*'
    median_ms 'subsampling|odometry|map'
    echo
}

echo '| sensor | mode | scene | ATE, cm | valid | IoU | precision | recall | MOTA | IDF1 | CPU of a frame, ms | of it odometry |'
echo '|---|---|---|---|---|---|---|---|---|---|---|---|'
for sensor in $sensors; do
    model=${sensor%%:*} mode=${sensor##*:}
    for scene in $scenes; do
        speed=1
        [[ $scene == street ]] && speed=5
        name=$model-$mode-$scene
        make_drive "$name" "$scene" --sensor "$model" --mode "$mode" --seed "$seed" --speed "$speed" --frames "$frames"
        printf '| %s | %s | %s |' "$model" "$mode" "$scene"
        score "$drives/$name"
        drop_drive "$name"
    done
done
