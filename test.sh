#!/usr/bin/env bash
# Installs what is missing, builds and tests.
#   ./test.sh          the release tests: what ./run.sh built, and the tests themselves, without the long ones
#   ./test.sh checks   the long release tests, and what costs builds of its own: bare build, contract tests under ASan and
#                      UBSan, format, tidy on what changed
#   ./test.sh full     both with the optional baselines, every file tidied, all tests under ASan, clang, TSan and a minute
#                      of every fuzz target
#   ./test.sh fuzz MINUTES [TARGET…]   every reader and `run` on mutated inputs, MINUTES each (tests/fuzz)
#   ./test.sh mutants [N] [--seed S …]   would the tests notice? N one-line changes of the product, one after the other
#                      (hours; tests/mutation/mutants.py --help)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
source .ci/prepare.sh

mode=${1:-tests}
usage() { echo "usage: ./test.sh [checks | full | fuzz MINUTES [TARGET...] | mutants [N]]" >&2; exit 2; }
case $mode in
    tests | checks | full) [ $# -le 1 ] || usage ;;
    fuzz) [[ ${2:-} =~ ^[0-9]+$ && $2 -gt 0 ]] || usage ;;
    mutants) ;;
    *) usage ;;
esac

if [ "$mode" = mutants ]; then
    install_missing "${base_packages[@]}" python3
    find_data
    shift
    exec python3 tests/mutation/mutants.py "$@"
fi

passed=0 failed=0 skipped=0 without_data=0

# run_tests PRESET [ctest arguments]: runs on after a failure, so that one run reports everything.
run_tests() {
    local preset=$1 folder
    folder=$(folder_of "$1")
    shift
    say "tests, $preset"
    local results=$PWD/$folder/results-$preset.xml
    rm -f "$results"
    ctest --preset "$preset" --output-junit "$results" -j2 "$@" >"$folder/tests.log" 2>&1 || true
    [ -s "$results" ] || { cat "$folder/tests.log" >&2; echo "no test ran in $preset" >&2; exit 1; }
    local head tests failures skips
    head=$(tr '\n\t' '  ' <"$results" | sed 's/<testcase.*//')
    tests=$(sed -E 's/.* tests="([0-9]+)".*/\1/' <<<"$head")
    failures=$(sed -E 's/.* failures="([0-9]+)".*/\1/' <<<"$head")
    skips=$(sed -E 's/.* skipped="([0-9]+)".*/\1/' <<<"$head")
    [[ "$tests $failures $skips" =~ ^[0-9]+\ [0-9]+\ [0-9]+$ && $tests -gt 0 ]] ||
        { echo "cannot read the counts in $results" >&2; exit 1; }
    passed=$((passed + tests - failures - skips)) failed=$((failed + failures)) skipped=$((skipped + skips))
    without_data=$((without_data + $(grep -c 'no data: ' "$results" || true)))
    [ "$failures" -eq 0 ] || tail -n 200 "$folder/tests.log"
    tail -n 3 "$folder/tests.log"
}

# check NAME command…: one more test that is not ctest's.
check() {
    local name=$1
    shift
    say "$name"
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "FAILED: $name"; fi
}

format_is_clean() {
    git ls-files -z -- '*.cpp' '*.hpp' | xargs -0 clang-format-14 --dry-run --Werror
}

tidy_is_clean() {
    local files
    if [ "$mode" = full ]; then
        files=$(git ls-files -- 'src/*.cpp' 'baselines/*.cpp')
    else
        # What the last commit and the work tree changed, most lines first; headers are seen through the files that
        # include them. A sweep over all files is left to `full` beyond the first 60.
        files=$( { git diff --numstat --no-renames --diff-filter=d HEAD; git diff --numstat --no-renames --diff-filter=d HEAD~1 HEAD; } 2>/dev/null |
            sort -rn | awk '{print $3}' | grep -E '^(src|baselines)/.*\.cpp$' | awk '!seen[$0]++' | head -n 60 || true)
    fi
    [ -n "$files" ] || { echo "nothing changed"; return 0; }
    # clang-tidy cannot read what GCC precompiled.
    cmake --preset release -B build/tidy -DTROCAR_PYTHON=ON -DTROCAR_PRECOMPILED=OFF -DTROCAR_UNITY=OFF >/dev/null
    # A header that the build writes.
    cmake --build build/tidy --target trocar_source_state >/dev/null
    # Only files that this build compiles: a method whose library is absent has no compile command.
    local built=()
    for file in $files; do
        grep -q "/$file\"" build/tidy/compile_commands.json && built+=("$file")
    done
    [ ${#built[@]} -gt 0 ] || { echo "nothing built changed"; return 0; }
    printf '%s\n' "${built[@]}" | xargs -P2 -n1 clang-tidy-14 --quiet -p build/tidy
}

# fuzz MINUTES [TARGET…]
fuzz() {
    configure fuzz
    build fuzz fuzz_targets
    check "fuzzing" tests/fuzz/fuzz.sh "$@"
}

install_missing "${base_packages[@]}"
[ "$mode" != full ] || install_missing "${full_packages[@]}" "${baseline_packages[@]}"
if [ "$mode" = fuzz ]; then
    install_missing "${fuzz_packages[@]}"
else
    install_missing "${python_packages[@]}"
fi
find_data
started=$SECONDS

if [ "$mode" = tests ] || [ "$mode" = full ]; then
    configure release -DTROCAR_PYTHON=ON
    build release
    run_tests release -LE long
fi

if [ "$mode" = full ]; then
    # Before the builds and tests that take longest, so that what fails here is reported soon.
    configure clang
    build clang
    run_tests clang
    configure tsan
    # The one thread that trocar starts is that of pairs beside depths in `trocar judge`. What else may race is a handler of
    # signals with the run that it ends, a child with its start, and what the libraries of methods keep for each thread.
    build tsan trocar_program contract_test file_command_test run_command_test study_command_test study_test
    run_tests tsan -R '^(JudgeCommand|StudyCommand|RunCommand|RunnerTest|Every/(Detector|QueryDistance)Contract)[.]'
    fuzz 1
fi

if [ "$mode" = checks ] || [ "$mode" = full ]; then
    install_missing "${check_packages[@]}"

    configure release -DTROCAR_PYTHON=ON
    build release
    run_tests release -L long

    configure bare
    build bare trocar_program contract_test
    # Of contract_test alone: programs that were built with the baselines still list them.
    run_tests bare -R '(Detector|QueryDistance)Contract'
    # It shares the folder of release, whose program must not be left without its baselines.
    configure release
    build release trocar_program

    if [ "$mode" = full ]; then
        configure dev -DTROCAR_CORE=OFF
        build dev
        run_tests dev
    else
        configure dev -DTROCAR_CORE=ON
        build dev contract_test stepper_contract_test
        run_tests dev -R Contract
    fi

    check "format" format_is_clean
    check "tidy" tidy_is_clean
fi

[ "$mode" != fuzz ] || fuzz "${@:2}"

say "done in $((SECONDS - started)) s"
[ "$without_data" -eq 0 ] || echo "skipped: $without_data checks, no data"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
