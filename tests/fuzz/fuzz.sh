#!/usr/bin/env bash
# tests/fuzz/fuzz.sh MINUTES [TARGET…]: MINUTES of every target (or of those named), as many at a time as there are cores
# or TROCAR_FUZZ_JOBS says; prints how many inputs each has taken. Status 1 when one of them made a find, at which its
# target stops; the input lies in build/fuzz/finds. What leads to new places in the code is kept in build/fuzz/corpus
# for the next time.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=$PWD/build/fuzz
seconds=$((60 * $1))
shift

# run_target TARGET arguments…: appends to its log.
run_target() {
    local target=$1 limit=5 longest=4096
    shift
    # Readers refuse within 5 s even under the sanitizers. What runs a scene works ten times longer under them than the
    # program does, which may take 5 s.
    [ "$target" != run ] || limit=50
    # Some records with all their figures.
    [ "$target" != report ] || longest=32768
    # The quarantine of ASan counts as memory in use. Readers say on stderr what they refuse.
    ASAN_OPTIONS=quarantine_size_mb=64 UBSAN_OPTIONS=print_stacktrace=1 \
        ASAN_SYMBOLIZER_PATH=$(command -v llvm-symbolizer-16) \
        "$folder/bin/fuzz_$target" -timeout="$limit" -rss_limit_mb=1024 -malloc_limit_mb=1024 -max_len="$longest" -close_fd_mask=3 \
        -artifact_prefix="$folder/finds/$target-" "$@" >>"$folder/log/$target" 2>&1
}

fuzz_one() {
    local target=$1 log=$folder/log/$1 end=$((SECONDS + seconds)) status=0 slow
    mkdir -p "$folder"/{finds,log,corpus/"$target"}
    : >"$log"
    while [ $((end - SECONDS)) -gt 0 ]; do
        status=0
        run_target "$target" -max_total_time=$((end - SECONDS)) -print_final_stats=1 \
            -dict="$folder/dictionaries/$target" "$folder/corpus/$target" "$folder/seeds/$target" || status=$?
        [ "$status" -ne 0 ] || break
        # Seconds are counted by the clock, and others may have had the core: what is slow is asked once more.
        slow=$(sed -nE 's/.*Test unit written to (.*-timeout-.*)/\1/p' "$log" | tail -n 1)
        [ -n "$slow" ] && [ -e "$slow" ] && run_target "$target" "$slow" || break
        rm "$slow"
        status=0
    done
    echo "$status" >"$log.status"
}
export -f fuzz_one run_target
export folder seconds

python3 tests/fuzz/make_corpus.py "$PWD" "$folder" ${TROCAR_DATA:+"$TROCAR_DATA"}
mapfile -t targets < <([ $# -gt 0 ] && printf '%s\n' "$@" || ls "$folder/seeds")
# Inputs of readers that want a file lie in memory where that is possible.
TMPDIR=$(mktemp -d -p "$([ -w /dev/shm ] && echo /dev/shm || echo /tmp)" trocar-fuzz.XXXXXX)
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT
echo "$((seconds / 60)) min each: ${targets[*]}"
printf '%s\n' "${targets[@]}" | xargs -P "${TROCAR_FUZZ_JOBS:-$(nproc)}" -I '{}' bash -c 'fuzz_one {}'

all=0 status=0
printf '%-16s %12s %8s\n' target inputs ended
for target in "${targets[@]}"; do
    log=$folder/log/$target
    inputs=$(awk '/^stat::number_of_executed_units:/ { sum += $2 } END { print sum + 0 }' "$log")
    all=$((all + inputs))
    ended=well
    [ "$(cat "$log.status")" -eq 0 ] || { ended=FIND status=1; }
    printf '%-16s %12s %8s\n' "$target" "$inputs" "$ended"
done
printf '%-16s %12s\n' all "$all"
for target in "${targets[@]}"; do
    [ "$(cat "$folder/log/$target.status")" -ne 0 ] || continue
    echo
    grep -aE '^FIND|ERROR|runtime error|SUMMARY|Test unit written|^ +#[0-9]+ .* in trocar' "$folder/log/$target"
done
exit "$status"
