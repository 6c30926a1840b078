#!/usr/bin/env bash
# Prints how many compilers to run at once: one a core, but no more than memory allows (2 GB each).
set -euo pipefail
cores=$(nproc)
memory=$(awk '/MemAvailable/ {print int($2 / 2000000)}' /proc/meminfo)
jobs=$((cores < memory ? cores : memory))
echo $((jobs > 0 ? jobs : 1))
