#!/usr/bin/env bash
# Fuzzes each target, one after the other: tests/fuzz/run.sh [SECONDS each], by default 600, or tests/fuzz/run.sh
# --inputs COUNT, with as many inputs each. Inputs that reach new code are kept in build/fuzz/corpus; one that fails is
# written to build/fuzz/findings, and belongs into tests/fuzz/corpus together with the fix.
set -euo pipefail

if [[ ${1:-} == --inputs ]]; then
  limit=-runs=${2:?a count}
else
  limit=-max_total_time=${1:-600}
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"
harness/install-packages.sh development
cmake --preset fuzz
cmake --build --preset fuzz

mkdir -p build/fuzz/findings
failed=0
for seeds in tests/fuzz/corpus/*/; do
  target=$(basename "$seeds")
  mkdir -p "build/fuzz/corpus/$target"
  echo "$target"
  "build/fuzz/tests/fuzz/${target}_fuzzer" "$limit" -max_len=16384 -timeout=20 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/findings/$target-" "build/fuzz/corpus/$target" "$seeds" || failed=1
done
exit "$failed"
