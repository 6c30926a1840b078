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

# "percent valid, largest error in mm and degrees, longest time without pose in s" of one replay
score() {  # DRIVE USE_IMU
    "$build/daemon/dlod" replay "$1.pcap" --set log.level=error --set "odometry.use_imu=$2" --out "$work/run" >/dev/null
    awk '
        # c = a * b of quaternions x y z w
        function multiply(a, b, c) {
            c[1] = a[4] * b[1] + a[1] * b[4] + a[2] * b[3] - a[3] * b[2]
            c[2] = a[4] * b[2] + a[2] * b[4] + a[3] * b[1] - a[1] * b[3]
            c[3] = a[4] * b[3] + a[3] * b[4] + a[1] * b[2] - a[2] * b[1]
            c[4] = a[4] * b[4] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
        }
        function invert(a, c) { for (k = 1; k < 4; ++k) c[k] = -a[k]; c[4] = a[4] }
        function rotate(q, v, c,    p, t, i) {
            for (k = 1; k < 4; ++k) p[k] = v[k]
            p[4] = 0; multiply(q, p, t); invert(q, i); multiply(t, i, c)
        }
        function read_pose(line, q, t,    f, i) {
            split(line, f, " ")
            for (i = 1; i < 4; ++i) t[i] = f[i + 1]
            for (i = 1; i < 5; ++i) q[i] = f[i + 4]
        }
        # The true pose at a time, between two of the known ones.
        function true_pose(time, q, t,    i, share, q1, t1) {
            while (at > 1 && when[at] > time) --at
            while (at < known - 1 && when[at + 1] <= time) ++at
            share = (time - when[at]) / (when[at + 1] - when[at])
            read_pose(truth[at], q, t); read_pose(truth[at + 1], q1, t1)
            sign = q[1] * q1[1] + q[2] * q1[2] + q[3] * q1[3] + q[4] * q1[4] < 0 ? -1 : 1
            for (i = 1; i < 4; ++i) t[i] += share * (t1[i] - t[i])
            for (i = 1; i < 5; ++i) q[i] += share * (sign * q1[i] - q[i])
            sign = sqrt(q[1] ^ 2 + q[2] ^ 2 + q[3] ^ 2 + q[4] ^ 2)
            for (i = 1; i < 5; ++i) q[i] /= sign
        }
        BEGIN { at = 1 }
        FNR == 1 { ++part }
        part == 1 { truth[++known] = $0; when[known] = $1 - 1.7e9; next }  # first, middle and last of each turn
        part == 2 {
            split($0, f, ",")
            if (FNR == 2) first_id = f[2]
            if (FNR > 1) { ++frames; last_column[sprintf("%.4f", f[3] / 1e9 - 1.7e9)] = when[3 * (f[2] - first_id + 1)] }
            next
        }
        {
            stamp = $1 - 1.7e9; turn_s = last_column[sprintf("%.4f", stamp)]
            if (stamp - turn_s > 0.5 || turn_s - stamp > 0.5) stamp -= clock
            true_pose(stamp, true_q, true_t); read_pose($0, q, t)
            if (FNR == 1) {
                invert(q, i); multiply(true_q, i, align)
                for (k = 1; k < 4; ++k) { first_t[k] = t[k]; first_true_t[k] = true_t[k] }
            } else if (stamp - last > longest) longest = stamp - last
            last = stamp; ++valid
            for (k = 1; k < 4; ++k) v[k] = t[k] - first_t[k]
            rotate(align, v, moved)
            e = 0
            for (k = 1; k < 4; ++k) e += (moved[k] + first_true_t[k] - true_t[k]) ^ 2
            if (e > worst) worst = e
            multiply(align, q, r); invert(true_q, i); multiply(i, r, d)
            sine = sqrt(d[1] ^ 2 + d[2] ^ 2 + d[3] ^ 2)
            angle = 2 * atan2(sine, d[4] < 0 ? -d[4] : d[4]) * 57.29578
            if (angle > worst_angle) worst_angle = angle
        }
        END {
            printf " %.0f %% | %.0f mm, %.2f deg | %.1f s |", 100 * valid / frames, 1000 * sqrt(worst), worst_angle, longest
        }
    ' clock="$3" <(sort -n "$1_truth"/poses_*tum.txt) "$work/run/frames.csv" "$work/run/trajectory.tum"
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
