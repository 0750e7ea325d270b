#!/usr/bin/env bash
# Holds harness/shipped/scenarios/README.md against the reader of scenarios: scenarios_document_test.sh DEXCHECK.
# The program must accept each key of the document's tables with its example, and the document must have each key and
# choice that the reader's sources name; so must that of studies.
set -euo pipefail

dexcheck=$1
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)
document=$root/harness/shipped/scenarios/README.md
status=0
fail() {
  echo "$*"
  status=1
}

# For each section with a table of keys, one line "SECTION<tab>START<tab>KEY<tab>EXAMPLE" per key; START is the line
# indented below the heading. Of keys that exclude each other, such as zyz and zyz_deg, the cell names both.
list_keys() {
  awk -F' *[|] *' -v OFS='\t' '
    /^## The run/ { section = "-"; start = "-" }
    /^## `\[/ { section = $0; gsub(/^## `\[|\]`$/, "", section); start = "-" }
    section ~ /^\[/ { section = substr(section, 2, length(section) - 2) ".0" }  # the first of a list of tables
    /^### `/ { section = "trajectory"; start = "-" }
    /^    [a-z]+ = / { start = $0; sub(/^ +/, "", start); sub(/ = /, "=", start) }
    /^\| `/ && NF == 8 && section != "" {
      keys = $2; gsub(/[`,]/, "", keys)
      example = $6; gsub(/`/, "", example)
      print section, start, keys, example
    }' "$document"
}

# What the program says to these keys. The scene that is given last does not exist, and nothing after the scenario is
# read: exit code 2 either way, and the message tells which it was.
ask() {
  local base=$1
  shift
  "$dexcheck" run "$base" --no-log --quiet "$@" --set plant.mjcf=no-such-scene.xml 2>&1 || true
}
accepts() {
  local message
  message=$(ask "$@")
  [[ $message == *no-such-scene.xml* ]] || { echo "$message" && false; }
}

cd "$(mktemp -d)"
trap 'rm -r "$PWD"' EXIT

# What must be refused: the test can fail.
if accepts paper --set plant.no_such_key=1 >refusal; then fail "an unknown key is accepted"; fi
grep -q no_such_key refusal || fail "an unknown key is not named: $(cat refusal)"

declare -A batches
count=0
while IFS=$'\t' read -r section start keys example; do
  prefix=$section.
  [[ $section != - ]] || prefix=
  number=0
  for key in $keys; do
    number=$((number + 1))
    count=$((count + 1))
    batches["$section|$start|$number"]+="$prefix$key=$example"$'\n'
  done
done < <(list_keys)
[[ $count -ge 80 ]] || fail "only $count keys are found in $document"
for batch in "${!batches[@]}"; do
  IFS='|' read -r section start number <<<"$batch"
  base=paper
  [[ $section != task ]] || base=lift
  [[ $section != joint_motion ]] || base=panda-reach
  arguments=()
  [[ $start == - ]] || arguments+=(--set "$start")
  # K_p and K_v, and an angle in degrees, stand in the place of what paper.toml has.
  [[ $section/$number != control/2 ]] || arguments+=(--set "control={ f_max = 50, mu = 0.6 }")
  [[ $section/$number != expect/2 ]] || arguments+=(--set "expect={ from = 0 }")
  while IFS= read -r assignment; do
    [[ -z $assignment ]] || arguments+=(--set "$assignment")
  done <<<"${batches[$batch]}"
  accepts "$base" "${arguments[@]}" || fail "[$section] is refused with the examples of $document"
done

# Keys and choices are texts of letters and _ in the reader's sources: explain_all DOCUMENT LEAST SOURCE...
explain_all() {
  local explained=$1 least=$2 words word
  shift 2
  mapfile -t words < <(sed -E 's://.*::' "$@" | grep -oE '"[A-Za-z][A-Za-z_]*"' | tr -d '"' | sort -u)
  [[ ${#words[@]} -ge $least ]] || fail "only ${#words[@]} keys are found in $*"
  for word in "${words[@]}"; do
    grep -qE "[\`\"[]$word[\`\"]|\`\[$word\]|\`\[\[$word\]\]|[|] $word [|]|[{ ,]$word = " "$explained" ||
      fail "$explained does not explain $word"
  done
  total=$((total + ${#words[@]}))
}
total=0
mapfile -t readers < <(find "$root/harness" -name 'scenario*.cc' -o -name 'scenario*.h' | sort)
explain_all "$document" 80 "${readers[@]}" "$root/controller/control/trajectory_reader.cc"
explain_all "$root/harness/shipped/studies/README.md" 35 "$root/harness/study/study.cc" "$root/harness/study/trial_result.h"

[[ $status -ne 0 ]] || echo "$count keys of the document are accepted, $total of the readers are explained"
exit $status
