#!/usr/bin/env bash
# Installs what is missing, builds, and runs the main job: the default study with its report.
#   ./run.sh                              the default study
#   ./run.sh run scenes/i2t_poke.json     any command of the program (./run.sh --help lists them)
#   ./run.sh --baselines [command …]      the same with the optional baseline libraries installed and built, the one under
#                                         the GPL too (do not give that binary away)
#   ./run.sh --baselines study bench/studies/detection.json   all detectors in turns on generated scenes
#   ./run.sh --python                     the Python module: builds it and prints the line that imports it
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
python=
if [ "${1:-}" = --python ]; then
    python=yes
    shift
    [ $# -eq 0 ] || { echo "run.sh: --python: expected nothing after it, got '$1'" >&2; exit 2; }
fi
{
    install_missing "${base_packages[@]}"
    gpl=OFF
    if [ -n "$baselines" ]; then
        install_missing "${baseline_packages[@]}"
        gpl=ON
    fi
    find_data
    if [ -n "$python" ]; then
        install_missing "${python_packages[@]}"
        configure release -DTROCAR_GPL=$gpl -DTROCAR_PYTHON=ON
        build release trocar_python
    else
        configure release -DTROCAR_GPL=$gpl
        build release trocar_program
    fi
} >&2
if [ -n "$python" ]; then
    echo "PYTHONPATH=$PWD/build/release/lib/python3/dist-packages /usr/bin/python3 -c 'import trocar; print(trocar.__version__)'"
    exit 0
fi
program=$PWD/build/release/bin/trocar
if [ $# -eq 0 ]; then
    say "default study" >&2
    exec "$program" study bench/studies/default.json --jobs "$(nproc)"
fi
# File names on the command line are the caller's.
cd "$caller"
exec "$program" "$@"
