#!/usr/bin/env bash
# Installs what is missing, builds and runs tests: tests/run.sh [PRESET], by default release, which builds everything and runs
# all tests. `fast` is for whoever works on the code: only the tests that start no process and take under a second each.
# At the end it says which tests were skipped and why.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}

purpose=tests
[[ ${1:-} != sanitize ]] || purpose=development
"$root/harness/install-packages.sh" "$purpose"
cd "$root"
preset=${1:-release}
said=$(mktemp)
trap 'rm -f "$said"' EXIT
code=0
cmake --workflow --preset "$preset" | tee "$said" || code=$?

# CTest names skipped tests without their reasons: the last line that each printed, or what GoogleTest says of one.
[[ $preset != fast ]] || preset=release
awk 'FNR == NR { if (/^\t *[0-9]+ - .* \(Skipped\)$/) is_skipped[$3] = ++count; next }
  /^[0-9]+\/[0-9]+ Test: / { name = $3; reason = ""; is_told = is_output = 0 }
  /^<end of output>/ { is_output = 0; if (name in is_skipped) print "  " name ": " reason }
  is_told == 1 { reason = $0; is_told = 2 }
  is_output && /: Skipped$/ { is_told = 1 }
  is_output && /[^[:space:]-]/ && !is_told { reason = $0 }
  /^Output:/ { is_output = 1; if (name in is_skipped && !head++) print "\n" count " tests were skipped:" }' \
  "$said" "build/$preset/Testing/Temporary/LastTest.log" 2>/dev/null || true
exit $code
