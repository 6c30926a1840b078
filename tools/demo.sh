#!/usr/bin/env bash
# Shows dlod at work: installs what is missing, builds (Release, in build/), simulates a drive through a busy square,
# replays it through dlod while an LCM subscriber listens, scores and draws the outcome.
# usage: tools/demo.sh [OUTPUT_FOLDER]     (default: out/demo)
# Can be run again at any time; without network once everything is installed.
set -euo pipefail
case ${1:-} in
    --help|-h) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
    -*) sed -n '2,5s/^# //p' "$0" >&2; exit 2 ;;
esac
cd "$(dirname "$0")/.."
out=${1:-out/demo}
case $out in /*) ;; *) out=$PWD/$out ;; esac
build=$PWD/build
frames=150

step() { printf '\n== %s\n' "$*"; }

tools/install-deps.sh
step "configure and build (Release)"
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build build -j "$(tools/build-jobs.sh)" --target dlod dlod-sim dlod-eval dlod-draw dlod-listen

step "simulate $frames frames of a walk through a busy square"
mkdir -p "$out"
"$build/tools/sim/dlod-sim" square --seed 7 --frames "$frames" --out "$out" --name demo

# LCM goes by UDP multicast that never leaves this host (TTL 0), on a port of its own.
lcm_url="udpm://239.255.76.67:17667?ttl=0&recv_buf_size=2000000"
replay_and_listen() {
    local listener
    "$build/tools/listen/dlod-listen" --lcm "$lcm_url" >"$out/messages.txt" 2>"$out/listener.log" &
    listener=$!
    for _ in $(seq 150); do
        grep -q listening "$out/listener.log" && break
        kill -0 "$listener" 2>/dev/null || return 1
        sleep 0.1
    done
    "$build/daemon/dlod" replay "$out/demo.pcap" --out "$out/run" --lcm "$lcm_url" --rate 1 --threads 2 >"$out/summary.txt" || return 1
    sleep 0.5
    kill -INT "$listener"
    wait "$listener"
}
export -f replay_and_listen
export build out lcm_url

step "replay at true rate through dlod, an LCM subscriber listens"
# In a network namespace of its own, where that is allowed: the host's network stays as it is.
in_namespace='ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && replay_and_listen'
if unshare --net --map-root-user true 2>/dev/null; then
    unshare --net --map-root-user bash -c "$in_namespace"
elif unshare --net true 2>/dev/null; then
    unshare --net bash -c "$in_namespace"
else
    replay_and_listen
fi || { echo "demo: replay or subscriber failed; see $out/summary.txt and $out/listener.log" >&2; exit 1; }

step "draw"
"$build/tools/eval/dlod-eval" "$out/demo_truth" "$out/run" --errors "$out/trajectory_error.csv" >"$out/scores.txt"
"$build/tools/draw/dlod-draw" "$out/run" --pcap "$out/demo.pcap" --truth "$out/demo_truth" --out "$out" --title "dlod demo" >/dev/null
gnuplot -e "run='$out/run'; out='$out'; errors='$out/trajectory_error.csv'" tools/report/plots.gp

score() { grep "^$1:" "$out/scores.txt" | grep -oE " $2=[^ ]+" | cut -d= -f2; }
step "summary"
head -n 1 "$out/summary.txt"
awk -v ate="$(score trajectory ate_m)" -v path="$(score trajectory path_m)" \
    'BEGIN { printf "trajectory error: %.1f mm (ATE) over a path of %.1f m\n", 1000 * ate, path }'
echo "dynamic mask: IoU $(score masks iou), precision $(score masks precision), recall $(score masks recall)"
echo "tracks: $(score tracks moving_objects) moving objects within 25 m, MOTA $(score tracks mota), IDF1 $(score tracks idf1)," \
    "$(score tracks id_switches) identity switches"
echo "map: $(score map ghost_pct) % ghost points, $(score map kept_pct) % of what stands still"
printf '\nmilliseconds a frame (with two threads, beside the subscriber):\n'
sed -n '/^step/,/^total/p' "$out/summary.txt"
printf '\nLCM messages received:\n'
cat "$out/messages.txt"
cat <<END

Written to $out:
  range_image.png       range image with the dynamic mask and the tracks' boxes
  residual_image.png    residuals of the scan-to-submap registration
  from_above.png        trajectory, tracks and map from above, with the truth
  milliseconds.svg      milliseconds over the frames, trajectory_error.svg the pose error over time
  run/                  trajectory, frames, labels, instances, tracks, map (see README.md, "Output files")
  demo.pcap, demo.json  the simulated drive, demo_truth/ its truth
END
