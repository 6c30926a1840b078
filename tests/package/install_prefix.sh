#!/usr/bin/env bash
# usage: install_prefix.sh BUILD_FOLDER
# `cmake --install --prefix` into an empty folder: programs start, units name them, completion and manual pages are
# whole, and a project outside of dlod finds the message types and links with them. 77: skipped.
set -euo pipefail
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
cmake --install "$1" --prefix "$prefix/opt" >/dev/null
export PATH=$prefix/opt/bin:$PATH

dlod --version
dlod check-config "$prefix/opt/etc/dlod/dlod.yaml"
dlod-listen --help >/dev/null
dlod-spy --help
grep -Fqx "ExecStart=$prefix/opt/bin/dlod run --config $prefix/opt/etc/dlod/dlod.yaml" \
    "$prefix/opt/lib/systemd/system/dlod.service"
if [[ -d $prefix/opt/share/man ]]; then
    for page in "$prefix"/opt/share/man/man*/*; do
        # Nothing of the build folder, and every page says what its program does.
        if grep -q "$1" "$page"; then echo "$page names the build folder"; exit 1; fi
        grep -q '^\.SH NAME' "$page"
    done
fi

"$(dirname "$0")/completion.sh" "$prefix/opt"

jar=$prefix/opt/share/dlod/dlod_types.jar
if [[ -f $jar ]]; then
    classes=$(jar tf "$jar")
    while read -r file; do
        package=$(sed -n 's/^package \(.*\);.*/\1/p' "$file")
        type=$(basename "$file" .lcm)
        grep -Fqx "$package/${type#"$package"_}.class" <<<"$classes"
    done < <(find "$prefix/opt/share/dlod/lcmtypes" -name '*.lcm')
    echo "the jar for dlod-spy has all types"
fi

cmake -S "$prefix/opt/share/doc/dlod/examples" -B "$prefix/planner" -DCMAKE_PREFIX_PATH="$prefix/opt" >/dev/null
cmake --build "$prefix/planner" >/dev/null
ldd "$prefix/planner/example_subscriber" | grep liblcm
echo "a planner's project is built with the installed types"
