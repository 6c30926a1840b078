#!/usr/bin/env bash
# usage: lintian.sh FOLDER     Debian's checker finds no errors in FOLDER/dlod_*.deb. 77: skipped.
set -euo pipefail
command -v lintian >/dev/null || { echo "skipped: no lintian here (tools/install-deps.sh --package)"; exit 77; }
exec lintian --fail-on error --tag-display-limit 0 "$1"/dlod_*.deb
