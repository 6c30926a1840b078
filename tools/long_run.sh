#!/usr/bin/env bash
# A long drive, replayed on one thread: valid poses, mean CPU time of a frame and resident memory, minute by minute.
# Neither may grow but for the map, which map.max_points bounds. Prints a Markdown table.
# usage: tools/long_run.sh [--minutes 10] [--scene street] [--speed 5] [--sensor OS1-32] [--mode 512x10] [--seed 1]
#                          [--keep FOLDER]
#   --keep    where the drive stays, to be used again; else it goes (180 MB a minute by default)
# Needs a build in build/, or in the folder that BUILD_DIR names. Run it on an idle machine.
set -euo pipefail
minutes=10 scene=street speed=5 sensor=OS1-32 mode=512x10 seed=1 keep=''
. "$(dirname "$0")/simulated_drives.sh" "minutes scene speed sensor mode seed keep" "$@"

name=long-$scene-$sensor-$mode-$speed-$seed-$minutes
make_drive "$name" "$scene" --sensor "$sensor" --mode "$mode" --seed "$seed" --speed "$speed" --duration $((60 * minutes))

"$build/daemon/dlod" replay "$drives/$name.pcap" --threads 1 --set output.timing=cpu --set log.level=error \
    --out "$work/run" >"$work/summary" &
replay=$!
# A byte a pixel: the file's size tells how far the replay is.
frame_bytes=$((${sensor##*-} * ${mode%x*}))
while memory_kb=$(awk '/^VmRSS/ { print $2 }' "/proc/$replay/status" 2>/dev/null) && [[ -n $memory_kb ]]; do
    written=$(stat -c %s "$work/run/labels.bin" 2>/dev/null || echo 0)
    echo "$((written / frame_bytes)) $memory_kb"
    sleep 0.1
done >"$work/memory"
wait $replay
drop_drive "$name"

echo '| minute | frames | valid poses | CPU of a frame, ms, mean | memory at its end, MB |'
echo '|---|---|---|---|---|'
awk -v frames_a_minute=$((60 * ${mode#*x})) '
    NR == FNR { memory_mb[int(($1 - 1) / frames_a_minute)] = $2 / 1000; next }
    FNR == 1 { next }
    {
        minute = int((FNR - 2) / frames_a_minute)
        ++frames[minute]
        split($0, cell, ",")
        valid[minute] += cell[7]
        for (i = 9; i in cell; ++i) cpu_ms[minute] += cell[i]
        last = minute
    }
    END {
        for (m = 0; m <= last; ++m)
            printf "| %d | %d | %d | %.1f | %.0f |\n", m + 1, frames[m], valid[m], cpu_ms[m] / frames[m], memory_mb[m]
    }' "$work/memory" "$work/run/frames.csv"
