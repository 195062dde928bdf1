#!/usr/bin/env bash
# Installs what is missing, builds, and runs the main job: the default study with its report.
#   ./run.sh                              the default study
#   ./run.sh run scenes/i2t_poke.json     any command of the program (./run.sh --help lists them)
#   ./run.sh --rivals [command …]         the same with the optional rival libraries installed and built
set -euo pipefail
caller=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
source .ci/prepare.sh

rivals=
if [ "${1:-}" = --rivals ]; then
    rivals=yes
    shift
fi
{
    install_missing "${base_packages[@]}"
    [ -z "$rivals" ] || install_missing "${rival_packages[@]}"
    find_data
    configure release
    build release trocar_program
} >&2
program=$PWD/build/release/bin/trocar
if [ $# -eq 0 ]; then
    say "default study" >&2
    exec "$program" study bench/studies/default.json
fi
# File names on the command line are the caller's.
cd "$caller"
exec "$program" "$@"
