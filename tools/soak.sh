#!/usr/bin/env bash
# Soak test: dlod live over loopback at true rate on a bad network, in a network namespace of its own. Its report is a
# table. usage: tools/soak.sh [--minutes N] [--latency] [--build DIR] [--report FILE]   default: 60 minutes, build/, none
#   --latency   a good network instead, and another program that keeps one processor busy: p99 of the time from the
#               last packet's receipt to the last message of a frame is at most 25 ms
set -euo pipefail
cd "$(dirname "$0")/.."

minutes=60
build=build
report=/dev/null
faults=()
arguments=("$@")
while (($#)); do
    case $1 in
        --minutes) minutes=$2; shift ;;
        --latency)
            faults=(--loss 0 --duplication 0 --reordering 0 --burst-every 0 --restart-every 1e9 --garbage 0
                --most-latency 25)
            ;;
        --build) build=$2; shift ;;
        --report) report=$2; shift ;;
        *) sed -n '2,5s/^# //p' "$0" && exit 2 ;;
    esac
    shift
done

if [[ -z ${DLOD_SOAK_NAMESPACE:-} ]]; then
    # Nobody else's packets, and ours are nobody else's; without the right to have one, on the host's loopback.
    if unshare -r -n true 2>/dev/null; then
        exec env DLOD_SOAK_NAMESPACE=own unshare -r -n "$0" "${arguments[@]}"
    fi
    DLOD_SOAK_NAMESPACE=none
fi
if [[ $DLOD_SOAK_NAMESPACE == own ]]; then
    ip link set lo up
    ip link set lo multicast on
    ip route add 224.0.0.0/4 dev lo
fi

folder=$build/soak
mkdir -p "$folder"
if [[ ! -f $folder/lap_truth/poses_tum.txt ]]; then
    "$build/tools/sim/dlod-sim" square --lap --speed 3 --duration 30 --name lap --out "$folder"
fi
"$build/daemon/dlod" replay "$folder/lap.pcap" --out "$folder/reference" &>"$folder/reference.log"
url='udpm://239.255.76.97:17697?ttl=0'
port=17602
"$build/daemon/dlod" run --set "sensor.metadata=$folder/lap.json" --set sensor.lidar_port=$port \
    --set sensor.imu_port=$((port + 1)) --set "lcm.url=$url" --set lcm.channel_prefix=SOAK_ \
    --set lcm.utime_source=sensor 2>"$folder/dlod.log" &
dlod=$!
started=("$dlod")
trap 'kill -TERM "${started[@]}" 2>/dev/null || true' EXIT
if ((${#faults[@]})); then
    # Of another session, as other programs are: the scheduler shares out between sessions.
    setsid sh -c 'while :; do :; done' &
    started+=($!)
fi
sleep 1

good=0
"$build/tools/soak/dlod-soak" "$folder/lap" --reference "$folder/reference/trajectory.tum" --lcm "$url" --port $port \
    --minutes "$minutes" "${faults[@]}" | tee "$report" || good=1
trap - EXIT
kill -TERM "${started[@]}" || true
code=0
wait $dlod || code=$?
echo "exit code of dlod: $code; its log: $folder/dlod.log ($(wc -l <"$folder/dlod.log") lines)" | tee -a "$report"
exit $((good + code))
