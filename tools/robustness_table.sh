#!/usr/bin/env bash
# What hard motions, faults and crowds do to the pose: simulated drives of 20 s through the square at 1 m/s unless their
# name says otherwise, in each of which one thing goes wrong, most of them 8 s after the start. Prints a Markdown table:
# the share of the frames with a valid pose, the largest error of position and rotation of a valid pose (against the
# truth, from the first valid pose on), and the longest time without a valid pose, with the IMU and without.
# usage: tools/robustness_table.sh [--seed 1] [--cases "NAME..."] [--keep FOLDER]
#   --keep    where the drives stay, to be used again; else they go when their scores are known
# Needs a build in build/, or in the folder that BUILD_DIR names.
set -euo pipefail
seed=1 keep='' cases='standstill turn kick sector loss20 loss60 gap1 gap3 imu_silent imu_stuck imu_spikes imu_axes
imu_scale clock_back clock_ahead crowd buses'
. "$(dirname "$0")/simulated_drives.sh" "seed cases keep" "$@"

# What a case is, and the simulator's arguments
describe() {  # CASE
    case $1 in
    standstill) echo 'standing for 60 s|square --speed 0 --duration 60' ;;
    turn) echo 'turn of 5 rad/s|square --fast-turn 8' ;;
    kick) echo 'kick of 2 g|square --kick 8' ;;
    sector) echo '60 % of the columns missing, one sector|square --missing-sector 60:276' ;;
    loss20) echo '20 % of the packets lost|square --loss 0.2' ;;
    loss60) echo '60 % of the packets lost|square --loss 0.6' ;;
    gap1) echo 'nothing for 1 s|square --gap 8:1' ;;
    gap3) echo 'nothing for 3 s|square --gap 8:3' ;;
    imu_*) echo "IMU for 4 s: ${1#imu_}|square --imu ${1#imu_} --imu-fault 8:4" ;;
    clock_back) echo 'clock 2 s back|square --clock-step 8:-2.03' ;;
    clock_ahead) echo 'clock 2 s ahead|square --clock-step 8:2.03' ;;
    crowd) echo 'start among 30 people|square --crowd 30' ;;
    buses) echo 'street at 5 m/s beside buses|street --speed 5 --buses' ;;
    *) echo "$1: no such case" >&2 && return 1 ;;
    esac
}

# Percent valid, worst valid pose and longest time without one, of one replay
score() {  # DRIVE USE_IMU CLOCK_STEP_S
    "$build/daemon/dlod" replay "$1.pcap" --set log.level=error --set "odometry.use_imu=$2" --out "$work/run" >/dev/null
    if [[ ! -s $work/run/trajectory.tum ]]; then
        printf ' 0 %% | | |'
        return
    fi
    "$build/tools/eval/dlod-eval" "$1_truth" "$work/run" --clock-step "$3" --json | awk '
        /": / { gsub(/[",:]/, ""); if (!($1 in value)) value[$1] = $2 }
        END {
            printf " %.0f %% | %.0f mm, %.2f deg | %.1f s |", value["valid_pct"], 1000 * value["worst_m"],
                   value["worst_deg"], value["longest_gap_s"]
        }'
}

echo '| drive | with IMU: valid | worst valid pose | longest without pose | without IMU: valid | worst valid pose | longest without pose |'
echo '|---|---|---|---|---|---|---|'
for case in $cases; do
    description=$(describe "$case")
    name=${case}_$seed
    read -ra arguments <<<"${description#*|}"
    for default in '--speed 1' '--duration 20'; do
        # shellcheck disable=SC2206
        [[ " ${arguments[*]} " == *" ${default% *} "* ]] || arguments+=($default)
    done
    make_drive "$name" "${arguments[@]}" --seed "$seed" 2>"$work/simulator.log"
    printf '| %s |' "${description%|*}"
    clock=0
    [[ $case != clock_* ]] || clock=${arguments[2]#*:}
    score "$drives/$name" true "$clock"
    if [[ $case == imu_* ]]; then echo ' | | |'; else score "$drives/$name" false "$clock" && echo; fi
    drop_drive "$name"
done
