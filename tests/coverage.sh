#!/usr/bin/env bash
# Prints which fraction of controller/'s lines its tests execute, file by file, and fails below the least share wanted:
# tests/coverage.sh [PERCENT], by default 95. Lines that no test reached are in build/coverage/lines.txt.
set -euo pipefail

least=${1:-95}
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
harness/install-packages.sh development

build=build/coverage
profiles=$root/$build/profiles
# One file per program, to which all its runs add.
export LLVM_PROFILE_FILE=$profiles/%m.profraw
cmake --preset coverage
cmake --build --preset coverage
rm -rf "$profiles"
mapfile -t programs < <(find "$build/tests" -maxdepth 1 -type f -executable -name '*_test' | sort)
for program in "${programs[@]}"; do
  filter='*'
  # A task's phases are tested where they meet contacts.
  [[ $program != */simulation_test ]] || filter='Lift*'
  "$program" --gtest_filter="$filter" --gtest_brief=1
done
objects=("${programs[0]}")
for program in "${programs[@]:1}"; do objects+=(-object "$program"); done
llvm-profdata-14 merge -sparse "$profiles"/*.profraw -o "$build/merged.profdata"
select=(-instr-profile="$build/merged.profdata" "${objects[@]}" "$root/controller")
llvm-cov-14 show -region-coverage-lt=100 "${select[@]}" >"$build/lines.txt" 2>/dev/null
report=$(llvm-cov-14 report -show-region-summary=false -show-branch-summary=false "${select[@]}" 2>/dev/null)
echo "$report"
awk -v least="$least" '$1 == "TOTAL" { share = $NF + 0; found = 1 }
  END { if (!found) exit 1; printf "controller/: %.2f %% of lines\n", share; exit share < least }' <<<"$report"
