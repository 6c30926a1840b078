#!/usr/bin/env bash
# Drift of the odometry on simulated drives: outdoors (square) and in corridors, at 0, 1, 2 and 5 m/s, several seeds
# each, with the IMU and without. Prints a Markdown table: mean and worst drift over the seeds in percent of the path,
# at 0 m/s the largest error of position in millimetres, and the share of valid poses.
# usage: tools/drift_table.sh [--sensor OS0-128] [--mode 1024x10] [--seeds 5] [--duration 20] [--scenes "square corridor"]
#                             [--speeds "0 1 2 5"] [--keep FOLDER]
#   --keep    where the drives stay, to be used again; else they go when their scores are known
# Needs a build in build/, or in the folder that BUILD_DIR names.
set -euo pipefail
sensor=OS0-128 mode=1024x10 seeds=5 duration=20 scenes='square corridor' speeds='0 1 2 5' keep=''
. "$(dirname "$0")/simulated_drives.sh" "sensor mode seeds duration scenes speeds keep" "$@"

# "drift or largest error, percent valid" of one replay
score() {  # DRIVE SPEED USE_IMU
    "$build/daemon/dlod" replay "$1.pcap" --set log.level=error --set "odometry.use_imu=$3" --out "$work/run" >/dev/null
    "$build/tools/eval/dlod-eval" "$1_truth" "$work/run" --errors "$work/errors.csv" --json >"$work/scores.json"
    awk -v speed="$2" '
        FNR == NR && /"(poses|truth_poses|drift_pct)":/ { gsub(/[",:]/, ""); value[$1] = $2; next }
        FNR != NR && FNR > 1 { split($0, f, ","); if (f[2] > largest) largest = f[2] }
        END { print speed == 0 ? 1000 * largest : value["drift_pct"], 100 * value["poses"] / value["truth_poses"] }
    ' "$work/scores.json" <(cat "$work/errors.csv")
}

echo "$sensor, $mode, $seeds seeds of $duration s each"
echo
echo '| scene | speed | with IMU: mean / worst | valid | without IMU: mean / worst | valid |'
echo '|---|---|---|---|---|---|'
for scene in $scenes; do
    for speed in $speeds; do
        for ((seed = 1; seed <= seeds; ++seed)); do
            name=${scene}_${speed}_$seed
            make_drive "$name" "$scene" --sensor "$sensor" --mode "$mode" --seed "$seed" --speed "$speed" \
                --duration "$duration"
            for imu in true false; do score "$drives/$name" "$speed" "$imu" >>"$work/${scene}_${speed}_$imu"; done
            drop_drive "$name"
        done
        printf '| %s | %s m/s |' "$scene" "$speed"
        for imu in true false; do
            awk -v unit="$([[ $speed == 0 ]] && echo mm || echo %)" '
                { sum += $1; valid += $2; if ($1 > worst) worst = $1 }
                END { printf " %.2f / %.2f %s | %.0f %% |", sum / NR, worst, unit, valid / NR }
            ' "$work/${scene}_${speed}_$imu"
        done
        echo
    done
done
