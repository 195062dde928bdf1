#!/usr/bin/env bash
# Installs what is missing, builds, and runs the main job: the default study with its report.
#   ./run.sh                              the default study
#   ./run.sh run scenes/i2t_poke.json     any command of the program (./run.sh --help lists them)
#   ./run.sh --baselines [command …]         the same with the optional baseline libraries installed and built
#   ./run.sh bench detection [--quick]    all detectors and baselines side by side; rebuilds reports/detection
#                                         (--quick: under 10 minutes; with other options only build/reports/detection)
#   ./run.sh docs                         the texts of docs as pages in build/docs
#   ./run.sh bench far_field              a stepper that moves a part of the tissue against one that moves all of it
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
if [ "${1:-}" = bench ]; then
    shift
    {
        install_missing "${base_packages[@]}"
        # Without its baselines the benchmark says little, but it runs: they are listed as absent.
        (install_missing "${baseline_packages[@]}") || say "baselines could not be installed"
        configure bench
        build bench trocar_bench
    } >&2
    case "$*" in detection | "detection --quick") set -- "$@" --publish ;; esac
    exec "$PWD/build/bench/bin/trocar_bench" "$@"
fi
{
    install_missing "${base_packages[@]}"
    [ -z "$baselines" ] || install_missing "${baseline_packages[@]}"
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
