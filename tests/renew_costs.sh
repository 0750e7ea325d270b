#!/usr/bin/env bash
# Writes tests/costs.txt from the times of the last runs of CTest: tests/renew_costs.sh [BUILD], by default build/release.
# CTest starts the tests that take longest first; a build that has not run them yet begins with these times.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
times=${1:-$root/build/release}/Testing/Temporary/CTestCostData.txt
[[ -r $times ]] || { echo "renew_costs: $times: cannot be read; run the tests first" >&2; exit 2; }
# Lines of CTest are NAME RUNS SECONDS, then --- and the tests that failed. Those of under half a second fill any gap.
awk '$1 == "---" { exit } $3 >= 0.5 { printf "%s 1 %.1f\n", $1, $3 }' "$times" | sort -k 3,3 -rn -k 1,1 >"$root/tests/costs.txt"
echo "---" >>"$root/tests/costs.txt"
echo "$(($(wc -l <"$root/tests/costs.txt") - 1)) tests of half a second and more"
