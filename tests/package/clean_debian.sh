#!/usr/bin/env bash
# usage: clean_debian.sh FOLDER
# Installs, upgrades, removes and purges FOLDER/dlod_*.deb in a clean Debian 12, and replays a simulated drive there.
# Needs mmdebstrap, root or user namespaces, and Debian's archive. 77: skipped.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
skip() { echo "skipped: $*"; exit 77; }
command -v mmdebstrap >/dev/null || skip "no mmdebstrap here (tools/install-deps.sh --package)"
[[ $(id -u) -eq 0 ]] || unshare --user --map-auto true 2>/dev/null || skip "neither root nor user namespaces"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The same files as an older version, to be upgraded.
new=$(ls "$1"/dlod_*.deb)
dpkg-deb -R "$new" "$work/old"
sed -i 's/^Version: .*/Version: 0.0.1/' "$work/old/DEBIAN/control"
echo "# as in an older version" >>"$work/old/etc/dlod/dlod.yaml"
dpkg-deb -b "$work/old" "$work/dlod_old.deb" >/dev/null

cat >"$work/try.sh" <<END
#!/usr/bin/env bash
root=\$1
# The archive may be out of reach, which is no fault of the package.
chroot "\$root" apt-get install -qy --no-install-recommends --download-only /root/old.deb >/dev/null || { echo unreachable >"$work/outcome"; exit 1; }
if chroot "\$root" bash /root/inside.sh; then echo good >"$work/outcome"; else echo failed >"$work/outcome"; fi
END
chmod +x "$work/try.sh"
echo unreachable >"$work/outcome"
mmdebstrap --quiet --variant=apt --format=null --aptopt='Acquire::Languages "none"' --aptopt='Acquire::Retries "2"' \
    --dpkgopt=force-unsafe-io \
    --customize-hook="upload $work/dlod_old.deb /root/old.deb" --customize-hook="upload $new /root/new.deb" \
    --customize-hook="upload $here/inside_clean_debian.sh /root/inside.sh" --customize-hook="$work/try.sh" \
    bookworm - >/dev/null || true
case $(cat "$work/outcome") in
    good) echo "installed, upgraded, used, removed and purged in a clean Debian 12" ;;
    unreachable) skip "no clean Debian could be made: is its archive out of reach?" ;;
    *) exit 1 ;;
esac
