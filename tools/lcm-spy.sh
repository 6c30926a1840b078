#!/usr/bin/env bash
# Starts Debian's lcm-spy with dlod's message types. In a clone they are those of the build; installed, the package's.
# usage: dlod-spy [LCM_URL]    (tools/lcm-spy.sh in a clone; BUILD_DIR: the build folder, default build)
# Debian's own start script passes a flag that Java 17 refuses, so the classes are started here.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
case ${1:-} in
    --help|-h) sed -n '2,3s/^# //p' "$0"; exit 0 ;;
    -*) sed -n '2,3s/^# //p' "$0" >&2; exit 2 ;;
esac
if [[ -f $here/install-deps.sh ]]; then
    types=${BUILD_DIR:-$here/../build}/lcmtypes/dlod_types.jar
    remedy="tools/install-deps.sh --spy, and build the project again"
else
    types=$here/../share/dlod/dlod_types.jar
    remedy="apt install default-jre liblcm-java libjchart2d-java"
fi
[[ -f $types ]] || { echo "lcm-spy: $types is not there: $remedy" >&2; exit 1; }
command -v java >/dev/null || { echo "lcm-spy: java is not there: $remedy" >&2; exit 1; }
classpath=$types
for jar in lcm jchart2d jide-oss xmlgraphics-commons commons-io; do
    if [[ -f /usr/share/java/$jar.jar ]]; then
        classpath+=:/usr/share/java/$jar.jar
    elif [[ $jar == lcm || $jar == jchart2d ]]; then
        echo "lcm-spy: /usr/share/java/$jar.jar is not there: $remedy" >&2; exit 1
    fi
done
[[ -n ${DISPLAY:-} ]] || { echo "lcm-spy: it shows a window, and there is no DISPLAY: log in with ssh -X, or see what dlod-listen counts" >&2; exit 1; }
# lcm-spy looks into every class of the path: the export is for those of jide-oss.
exec java --add-exports=java.desktop/sun.swing=ALL-UNNAMED -Djava.net.preferIPv4Stack=true -Xmx128m -ea -cp "$classpath" lcm.spy.Spy ${1:+--lcm-url="$1"}
