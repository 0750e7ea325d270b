#!/usr/bin/env bash
# Commits with the hooks of .pre-commit-hooks.yaml, as a repository with robot descriptions would: pre_commit_test.sh DEXCHECK
set -euo pipefail

for tool in pre-commit git; do
  command -v "$tool" >/dev/null || { echo "skipped, not found: $tool"; exit 77; }
done
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export HOME=$scratch PRE_COMMIT_HOME=$scratch/cache GIT_CONFIG_GLOBAL=$scratch/gitconfig GIT_CONFIG_NOSYSTEM=1
git config --global user.name test
git config --global user.email test@example.org
git config --global init.defaultBranch main
mkdir "$scratch/bin" "$scratch/hooks" "$scratch/robot"
ln -s "$(realpath "$1")" "$scratch/bin/dexcheck"
export PATH=$scratch/bin:$PATH
fail() {
  echo "$*"
  cat "$scratch/out.txt"
  exit 1
}

# pre-commit clones a repository of hooks: here one with that file alone.
cp "$root/.pre-commit-hooks.yaml" "$scratch/hooks/"
git -C "$scratch/hooks" init --quiet
git -C "$scratch/hooks" add .pre-commit-hooks.yaml
git -C "$scratch/hooks" commit --quiet -m hooks

cd "$scratch/robot"
git init --quiet
cat >.pre-commit-config.yaml <<YAML
repos:
  - repo: file://$scratch/hooks
    rev: $(git -C "$scratch/hooks" rev-parse HEAD)
    hooks:
      - id: dexcheck-audit
      - id: dexcheck-consistency
        args: [panda.toml, panda.xml, --samples, "50"]
        files: ^panda\.(toml|xml)$
YAML
cp "$root/controller/parameters/panda.toml" "$root/mjcf/panda.xml" .
cp "$root/harness/descriptions/examples/arm.urdf" .
pre-commit install >"$scratch/out.txt"
git add .

# Commit MESSAGE CODE: a commit that goes through (0) or not (1).
Commit() {
  local status=0
  git commit --quiet -am "$1" >"$scratch/out.txt" 2>&1 || status=$?
  [[ $status -eq $2 ]] || fail "$1: git commit ended with $status"
}
Commit "agree" 0
grep -q 'dexcheck consistency.*Passed' "$scratch/out.txt" || fail "consistency was not asked"
grep -q 'dexcheck audit.*Passed' "$scratch/out.txt" || fail "audit was not asked"

sed -i 's/^gravity = .*/gravity = [0, 0, -9.8]/' panda.toml
Commit "another gravity" 1
grep -q '^DISAGREE' "$scratch/out.txt" || fail "the verdict is not shown"
grep -q 'dexcheck audit.*no files to check' "$scratch/out.txt" || fail "audit was asked of what it is not for"
git checkout --quiet panda.toml

sed -i '0,/mass value="[^"]*"/s//mass value="-1"/' arm.urdf
Commit "a negative mass" 1
grep -q 'arm.urdf' "$scratch/out.txt" || fail "the file is not named"
grep -q 'dexcheck consistency.*no files to check' "$scratch/out.txt" || fail "consistency was asked of another robot"
echo "pre-commit's hooks: agreement, disagreement, a finding of the audit"
