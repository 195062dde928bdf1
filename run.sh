#!/usr/bin/env bash
# Installs what is missing, builds, and runs the main job: the default study with its report.
#   ./run.sh                              the default study
#   ./run.sh run scenes/i2t_poke.json     any command of the program (./run.sh --help lists them)
#   ./run.sh --baselines [command …]      the same with the optional baseline libraries installed and built, the one under
#                                         the GPL too (do not give that binary away)
#   ./run.sh --baselines study bench/studies/detection.json   all detectors in turns on generated scenes
#   ./run.sh docs                         the texts of docs as pages in build/docs
set -euo pipefail
caller=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
source .ci/prepare.sh

baselines=
if [ "${1:-}" = --baselines ]; then
    baselines=yes
    shift
fi
if [ "${1:-}" = docs ]; then
    install_missing "${docs_packages[@]}" >&2
    exec mkdocs build --strict --quiet -f docs/mkdocs.yml
fi
{
    install_missing "${base_packages[@]}"
    gpl=OFF
    if [ -n "$baselines" ]; then
        install_missing "${baseline_packages[@]}"
        gpl=ON
    fi
    find_data
    configure release -DTROCAR_GPL=$gpl
    build release trocar_program
} >&2
program=$PWD/build/release/bin/trocar
if [ $# -eq 0 ]; then
    say "default study" >&2
    exec "$program" study bench/studies/default.json --jobs "$(nproc)"
fi
# File names on the command line are the caller's.
cd "$caller"
exec "$program" "$@"
