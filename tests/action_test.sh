#!/usr/bin/env bash
# Runs what the composite action .github/actions/consistency runs, as a job would: action_test.sh DEXCHECK
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
action=$root/.github/actions/consistency
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
fail() {
  echo "$*"
  exit 1
}

# Each input that the action declares reaches the script, and nothing but inputs does.
mapfile -t used < <(grep -oE 'inputs\.[a-z]+' "$action/action.yml" | sort -u | sed 's/inputs\.//')
mapfile -t declared < <(awk '/^inputs:/ { inside = 1; next } /^[a-z]/ { inside = 0 } inside && /^  [a-z]+:$/ { gsub(/[ :]/, ""); print }' \
  "$action/action.yml" | sort -u)
[[ ${used[*]} == "${declared[*]}" && ${#used[@]} -eq 5 ]] || fail "inputs ${declared[*]}, used ${used[*]}"
for variable in $(sed -nE 's/^ +(DEXCHECK_[A-Z]+): .*/\1/p' "$action/action.yml"); do
  grep -q "\$$variable\|{$variable" "$action/run.sh" || fail "$variable is not read"
done
[[ -x $action/run.sh ]] || fail "run.sh cannot be executed"

# Run CODE A B [NAME=VALUE...]: the script in a folder of its own.
Run() {
  local expected=$1 status=0
  rm -rf "$scratch/job"
  mkdir "$scratch/job"
  (cd "$scratch/job" && env DEXCHECK="$dexcheck" DEXCHECK_A="$2" DEXCHECK_B="$3" GITHUB_STEP_SUMMARY=summary.md "${@:4}" \
    "$action/run.sh" >out.txt 2>&1) || status=$?
  [[ $status -eq $expected ]] || fail "exit code $status, not $expected: $(cat "$scratch/job/out.txt")"
}
dexcheck=$1
toml=$root/controller/parameters/panda.toml
mjcf=$root/mjcf/panda.xml
Run 0 "$toml" "$mjcf" DEXCHECK_ARGUMENTS="--samples 50"
grep -q '^AGREE: ' "$scratch/job/summary.md" || fail "the summary has no verdict"
grep -q 'failures="0"' "$scratch/job/dexcheck.xml" || fail "no JUnit file, or with failures"

sed 's/^gravity = .*/gravity = [0, 0, -9.8]/' "$toml" >"$scratch/wrong.toml"
Run 1 "$scratch/wrong.toml" "$mjcf" DEXCHECK_ARGUMENTS="--samples 50 --quiet" DEXCHECK_JUNIT=wrong.xml DEXCHECK_AUDIT=true
grep -q '^::error::' "$scratch/job/out.txt" || fail "the job shows no error"
grep -q '<failure message="' "$scratch/job/wrong.xml" || fail "the JUnit file has no failure"
grep -q '### audit of ' "$scratch/job/summary.md" || fail "nothing was audited"
Run 2 "$scratch/none.toml" "$mjcf"
echo "the action's script: agreement, disagreement, bad input"
