#!/usr/bin/env bash
# Starts Debian's lcm-spy with dlod's message types.
# usage: tools/lcm-spy.sh [LCM_URL]     (BUILD_DIR: the build folder, default build)
# Debian's own start script passes a flag that Java 17 refuses, so the classes are started here.
set -euo pipefail
cd "$(dirname "$0")/.."
types=${BUILD_DIR:-build}/lcmtypes/dlod_types.jar
[[ -f $types ]] || { echo "$types is not there: build the project where a JDK and liblcm-java are installed" >&2; exit 1; }
command -v java >/dev/null || { echo "java is not there: tools/install-deps.sh --spy" >&2; exit 1; }
classpath=$types
for jar in lcm jchart2d jide-oss xmlgraphics-commons; do
    if [[ -f /usr/share/java/$jar.jar ]]; then
        classpath+=:/usr/share/java/$jar.jar
    elif [[ $jar == lcm || $jar == jchart2d ]]; then
        echo "/usr/share/java/$jar.jar is not there: tools/install-deps.sh --spy" >&2; exit 1
    fi
done
exec java -Djava.net.preferIPv4Stack=true -Xmx128m -ea -cp "$classpath" lcm.spy.Spy ${1:+--lcm-url="$1"}
