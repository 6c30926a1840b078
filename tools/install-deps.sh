#!/usr/bin/env bash
# Installs what dlod needs to build, test and demonstrate itself on Debian 12.
# usage: tools/install-deps.sh [--package] [--spy]
#   --package   also what makes and checks the Debian package (Java for the types' jar among it)
#   --spy       also what lcm-spy needs (Java)
# Does nothing, and needs neither network nor root, when everything is installed.
set -euo pipefail

packages=(
    # build
    g++ cmake ninja-build pkg-config ccache
    # core, driver, daemon
    libeigen3-dev libpcap-dev libboost-dev libyaml-cpp-dev libspdlog-dev libfmt-dev libcpp-httplib-dev nlohmann-json3-dev libcli11-dev libsystemd-dev
    libpcl-dev liblcm-dev liblcm-bin
    # tools
    libnanoflann-dev libopencv-dev libembree-dev gnuplot-nox
    # tests
    libgtest-dev libbenchmark-dev nettle-dev iproute2 systemd
)
for argument in "$@"; do
    case $argument in
        --package) packages+=(dpkg-dev help2man lintian mmdebstrap default-jdk-headless liblcm-java) ;;
        --spy) packages+=(default-jdk-headless default-jre liblcm-java libjchart2d-java) ;;
        *) sed -n '2,6s/^# //p' "$0"; exit 2 ;;
    esac
done

missing=()
for package in "${packages[@]}"; do
    status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
    [[ $status == installed ]] || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
    echo "packages: all ${#packages[@]} are installed"
    exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
    command -v sudo >/dev/null || { echo "install-deps: run as root, or install sudo; missing: ${missing[*]}" >&2; exit 1; }
    as_root=(sudo)
fi
echo "packages: installing ${missing[*]}"
"${as_root[@]}" apt-get -o DPkg::Lock::Timeout=300 update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 install -qy --no-install-recommends "${missing[@]}"
