#!/usr/bin/env bash
# Installs what is missing, builds, and runs the main job: the default study with its report.
#   ./run.sh                              the default study
#   ./run.sh run scenes/i2t_poke.json     any command of the program (./run.sh --help lists them)
#   ./run.sh --baselines [command …]      the same with the optional baseline libraries installed and built, the one under
#                                         the GPL too (do not give that binary away)
#   ./run.sh --baselines study bench/studies/detection.json   all detectors in turns on generated scenes
#   ./run.sh far_field [options]          a stepper that moves a part of the tissue against one that moves all of it
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
target=trocar_program
[ "${1:-}" != far_field ] || target=trocar_far_field
{
    install_missing "${base_packages[@]}"
    gpl=OFF
    if [ -n "$baselines" ]; then
        install_missing "${baseline_packages[@]}"
        gpl=ON
    fi
    find_data
    configure release -DTROCAR_GPL=$gpl
    build release "$target"
} >&2
if [ "$target" = trocar_far_field ]; then
    shift
    exec "$PWD/build/release/bin/trocar_far_field" "$@"
fi
program=$PWD/build/release/bin/trocar
if [ $# -eq 0 ]; then
    say "default study" >&2
    exec "$program" study bench/studies/default.json
fi
# File names on the command line are the caller's.
cd "$caller"
exec "$program" "$@"
