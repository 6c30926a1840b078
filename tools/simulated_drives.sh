# What the scripts that score many simulated drives have in common; they source it after their defaults, with their
# arguments. usage: . simulated_drives.sh "OPTION..." "$@"
# Each --OPTION VALUE sets the variable OPTION; any other argument prints the comment at the head of the script.
# Sets: build, work (a folder that goes at the end), drives (--keep, or work).
build=${BUILD_DIR:-$(dirname "${BASH_SOURCE[0]}")/../build}
options=" $1 "
shift
while [[ $# -gt 0 ]]; do
    if [[ $1 != --* || $# -lt 2 || $options != *" ${1#--} "* ]]; then
        awk 'NR > 1 && !/^#/ { exit } NR > 1 { sub(/^# ?/, ""); print }' "$0"
        exit 2
    fi
    printf -v "${1#--}" %s "$2"
    shift 2
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
drives=${keep:-$work}
mkdir -p "$drives"

# Simulates a drive unless it is there.
make_drive() {  # NAME SIMULATOR_ARGUMENT...
    [[ -e $drives/$1.json ]] || "$build/tools/sim/dlod-sim" "${@:2}" --out "$drives" --name "$1" >/dev/null
}

# Removes a drive that is not to be kept.
drop_drive() {  # NAME
    [[ -n $keep ]] || rm -rf "${drives:?}/$1"*
}
