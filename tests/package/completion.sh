#!/usr/bin/env bash
# usage: completion.sh PREFIX
# In an installation at PREFIX, bash completes every option that the help of a program or subcommand shows, and the manual
# pages, where they are made, have them all, too.
set -euo pipefail
prefix=$1
export PATH=$prefix/bin:$PATH

# What bash-completion's own function does, as far as it matters here.
_init_completion() { cur=${COMP_WORDS[COMP_CWORD]}; prev=${COMP_WORDS[COMP_CWORD - 1]}; words=("${COMP_WORDS[@]}"); cword=$COMP_CWORD; }
_filedir() { :; }
compopt() { :; }
# shellcheck source=../../packaging/bash-completion
source "$prefix/share/bash-completion/completions/dlod"

complete_words() {  # WORD...: what may follow, a word a line
    COMP_WORDS=("$@")
    COMP_CWORD=$(($# - 1))
    COMPREPLY=()
    _dlod
    printf '%s\n' "${COMPREPLY[@]}"
}
fail() { echo "$*"; exit 1; }

subcommands=$(dlod --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p')
[[ $(wc -w <<<"$subcommands") -ge 7 ]] || fail "the help of dlod shows no subcommands"
offered=$(complete_words dlod "")
for subcommand in $subcommands; do
    grep -qx -- "$subcommand" <<<"$offered" || fail "'dlod $subcommand' is not completed"
done
[[ $(complete_words dlod command save) == save-map ]] || fail "'dlod command save' is not completed"
[[ $(complete_words dlod-sim squ) == square ]] || fail "'dlod-sim squ' is not completed"
[[ $(complete_words dlod-sim --movers n) == none ]] || fail "'dlod-sim --movers n' is not completed"
[[ -z $(complete_words dlod-sim --seed "") ]] || fail "a number is completed after 'dlod-sim --seed'"
[[ $(complete_words dlod-sim --lap squ) == square ]] || fail "the scene is not completed after a flag"
# Not through pipes: grep ends at the first match, and whoever still writes then would fail.
grep -qx 'odometry.use_imu=' <<<"$(complete_words dlod run --set odometry.)" || fail "keys are not completed after --set"

pages=$prefix/share/man/man1
for program in dlod-sim dlod-eval dlod-draw dlod-listen dlod ${subcommands//$'\n'/ }; do
    command=("$program")
    page=$program
    if [[ $program != dlod* ]]; then
        command=(dlod "$program")
        page=dlod-$program
    fi
    options=$("${command[@]}" --help | grep -oE '^ +(-[a-z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+')
    [[ -n $options ]] || fail "the help of ${command[*]} shows no options"
    offered=$(complete_words "${command[@]}" -)
    for option in $options; do
        grep -qx -- "$option" <<<"$offered" || fail "'${command[*]} $option' is not completed"
        [[ ! -d $pages ]] || grep -q -- "$option" <<<"$(sed 's/\\//g' "$pages/$page.1")" || fail "$page.1 lacks $option"
    done
done
echo "completion and manual pages have every option"
