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
mapfile -t used < <(grep -oE 'inputs\.[a-z0-9]+' "$action/action.yml" | sort -u | sed 's/inputs\.//')
mapfile -t declared < <(awk '/^inputs:/ { inside = 1; next } /^[a-z]/ { inside = 0 } inside && /^  [a-z0-9]+:$/ { gsub(/[ :]/, ""); print }' \
  "$action/action.yml" | sort -u)
[[ ${used[*]} == "${declared[*]}" && ${#used[@]} -eq 7 ]] || fail "inputs ${declared[*]}, used ${used[*]}"
for variable in $(sed -nE 's/^ +(DEXCHECK_[A-Z0-9]+): .*/\1/p' "$action/action.yml"); do
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

# An archive with a program that tells where it was.
command -v curl >/dev/null || { echo "skipped, not found: curl"; exit 77; }
dexcheck=/nowhere
mkdir -p "$scratch/dexcheck-1/bin"
printf '#!/bin/sh\necho "from the archive"\nexec "%s" "$@"\n' "$(realpath "$1")" >"$scratch/dexcheck-1/bin/dexcheck"
chmod +x "$scratch/dexcheck-1/bin/dexcheck"
tar -C "$scratch" -cJf "$scratch/archive.tar.xz" dexcheck-1
archive=DEXCHECK_ARCHIVE=file://$scratch/archive.tar.xz
read -r sum _ < <(sha256sum "$scratch/archive.tar.xz")
Run 0 "$toml" "$mjcf" DEXCHECK_ARGUMENTS="--samples 50" "$archive" DEXCHECK_SHA256="$sum"
grep -q '^from the archive' "$scratch/job/summary.md" || fail "the archive's program did not run"
Run 1 "$scratch/wrong.toml" "$mjcf" DEXCHECK_ARGUMENTS="--samples 50" "$archive"
Run 2 "$toml" "$mjcf" "$archive" DEXCHECK_SHA256="${sum//[0-4]/5}"
grep -q '^::error::.*SHA-256' "$scratch/job/out.txt" || fail "another archive is taken"
Run 2 "$toml" "$mjcf" DEXCHECK_ARCHIVE="file://$scratch/none.tar.xz"
grep -q '^::error::.*none.tar.xz: cannot be had' "$scratch/job/out.txt" || fail "a missing archive is not named"
echo "the action's script: agreement, disagreement, bad input, an archive"
