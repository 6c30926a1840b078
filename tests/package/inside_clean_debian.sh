#!/usr/bin/env bash
# Run by clean_debian.sh within the clean Debian: /root/old.deb and /root/new.deb are there, their dependencies downloaded.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive LC_ALL=C
say() { printf '== %s\n' "$*"; }
trap 'echo "failed at line $LINENO: $BASH_COMMAND"' ERR

say "install"
apt-get install -qy --no-install-recommends /root/old.deb >/root/install.log || { cat /root/install.log; exit 1; }
echo "log: {level: debug}" >>/etc/dlod/dlod.yaml

say "upgrade: the operator's configuration stays"
dpkg --force-confold -i /root/new.deb >/dev/null
[[ $(dpkg-query -W -f '${Status}' dlod) == "install ok installed" ]]
grep -q "level: debug" /etc/dlod/dlod.yaml
dlod --version
dlod check-config /etc/dlod/dlod.yaml

say "simulate and replay"
dlod-sim square --seed 3 --sensor OS0-32 --mode 512x10 --frames 6 --out /root/drive
dlod replay /root/drive/square.pcap --out /root/run --threads 2
# One line of header; a frame whose end the capture does not show may be missing.
frames=$(($(wc -l </root/run/frames.csv) - 1))
[[ $frames -ge 5 && $(wc -l </root/run/trajectory.tum) -eq $frames ]]
dlod-eval --skip 1 /root/drive/square_truth /root/run
dlod-draw /root/run --pcap /root/drive/square.pcap --out /root/pictures >/dev/null
[[ -s /root/pictures/range_image.png ]]
# Unconfigured, the service says what it needs.
code=0
dlod run --config /etc/dlod/dlod.yaml 2>/root/run.log || code=$?
[[ $code -eq 3 ]]
grep -q "sensor.host" /root/run.log

say "remove: configuration stays; purge: nothing does"
dpkg --remove dlod >/dev/null
[[ ! -e /usr/bin/dlod && -e /etc/dlod/dlod.yaml ]]
dpkg --purge dlod >/dev/null
left=$(find / -xdev -name '*dlod*' -not -path '/root/*' -not -path '/proc/*' -not -path '/sys/*' -not -path '/var/log/*')
[[ -z $left ]] || { echo "left behind: $left"; exit 1; }
