#!/usr/bin/env bash
# Do two builds of the program say the same? compare_builds.sh BEFORE AFTER [SECONDS [SCENARIO...]]
# Runs each shipped scenario with both, for SECONDS of simulated time (1), and compares exit code, summary (but for
# speed, machine and version) and each number of the log; then the counts of the faults that `mutate` finds.
set -uo pipefail

before=$(realpath "$1") after=$(realpath "$2") seconds=${3:-1}
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
scenarios=("${@:4}")
[[ ${#scenarios[@]} -gt 0 ]] || mapfile -t scenarios < <("$before" run --list | awk '/^ *[a-z]/ { print $1 }')
differing=0

# Both PROGRAM...: their exit codes and outputs, in $scratch/before and after.
Both() {
  local side
  for side in before after; do
    mkdir -p "$scratch/$side"
    (cd "$scratch/$side" && "${!side}" "$@" >output.txt 2>&1; echo $? >code.txt) &
  done
  wait
}
Summary() { jq -S 'del(.speed, .machine, .versions) | del(.. | .description?)' "$scratch/$1/run/summary.json"; }

for scenario in "${scenarios[@]}"; do
  rm -rf "$scratch/before" "$scratch/after"
  Both run "$scenario" --set "duration=$seconds" --set "settle=0.5" --out run --no-report --quiet
  what=same
  cmp -s "$scratch"/{before,after}/code.txt || what="exit codes $(cat "$scratch"/{before,after}/code.txt | xargs)"
  if [[ $what == same && -e $scratch/before/run/log.h5 ]]; then
    diff <(Summary before) <(Summary after) >"$scratch/summaries.txt" || what="summaries: $(sed -n '2,5p' "$scratch/summaries.txt")"
    h5diff --exclude-path /meta --exclude-path /inputs "$scratch"/{before,after}/run/log.h5 >"$scratch/logs.txt" 2>&1 ||
      what="$what, logs: $(head -4 "$scratch/logs.txt")"
  fi
  printf '%-14s exit code %s  %s\n' "$scenario" "$(cat "$scratch/before/code.txt")" "$what"
  [[ $what == same ]] || differing=$((differing + 1))
done
for run in hold panda-reach; do
  Both mutate "$run" --numbers 20 --json results.json
  what=same
  diff <(jq -S . "$scratch/before/results.json") <(jq -S . "$scratch/after/results.json") >"$scratch/mutants.txt" ||
    what="$(head -6 "$scratch/mutants.txt")"
  printf '%-14s mutate: %s\n' "$run" "$what"
  [[ $what == same ]] || differing=$((differing + 1))
done
exit $((differing > 0))
