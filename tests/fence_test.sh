#!/usr/bin/env bash
# Fails when harness/engine or harness/plant use more of the analytic model than tests/engine_headers.txt allows, or when the
# list has more than they use: an error in a formula that is on both sides stays unseen. fence_test.sh ROOT
# Exit code: 0 as the list has it, 1 not, 2 nothing to look at. independence_test.sh looks at the other side.
set -euo pipefail

# Prints what is wrong with the tree ROOT and its list.
list_faults() (
  cd "$1"
  list=tests/engine_headers.txt
  sources=(harness/engine harness/plant --include=*.h --include=*.cc)
  grep -roE '^#include "controller/[^"]+"' "${sources[@]}" | sed -E 's/^(.*)\.(h|cc):#include "(.*)"$/\3 \1/' |
    awk 'NR == FNR { if (sub(/:.*/, "") && !/^#/) allowed[$0] = 1; next }
      { used[$1 in allowed ? $1 : $0] = 1 }
      !($1 in allowed) && !($0 in allowed) { print $2 ": includes " $1 ", which is not on the list" }
      END { for (entry in allowed) if (!(entry in used)) print entry ": is on the list, and not included" }' "$list" -
  # What headers that all may include declare besides data.
  formulas=$(sed -nE 's/^(controller[^ ]*): .*/\1/p' "$list" | xargs grep -hoE '\<Calc\w+\(' | sort -u | tr -d '(' | paste -sd'|')
  grep -rnwE "$formulas" "${sources[@]}" | sed 's/$/  <- calls a formula of the model/' || true
)

root=$1
[[ $(find "$root"/harness/{engine,plant} -name '*.cc' | wc -l) -gt 10 ]] || { echo "no sources in $root"; exit 2; }

# What must be found: the test can fail.
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
mkdir -p "$scratch"/{controller,harness/engine,harness/plant,tests}
echo 'Pose CalcPose();' | tee "$scratch/controller/robot.h" >"$scratch/controller/text.h"
printf '#include "controller/robot.h"\nCalcPose();\n' >"$scratch/harness/engine/terms.cc"
echo '#include "controller/platform.h"' >"$scratch/harness/plant/engine_plant.h"
printf 'controller/%s.h: data\n' robot text >"$scratch/tests/engine_headers.txt"
[[ $(list_faults "$scratch" | grep -c 'plant: includes controller/platform.h\|text.h: is on the list\|terms.cc:2:CalcPose') -eq 3 ]] ||
  { echo "a fault is not found"; exit 1; }

faults=$(list_faults "$root")
[[ -z $faults ]] || { echo "$faults"; exit 1; }
echo "harness/engine and harness/plant include what the list allows"
