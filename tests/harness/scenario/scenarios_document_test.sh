#!/usr/bin/env bash
# Holds harness/shipped/scenarios/README.md against the reader of scenarios: scenarios_document_test.sh DEXCHECK.
# The keys of each of the document's tables must be those that the reader knows there, the program must accept each with
# its example, and the document must have each choice that the reader's sources name; so must that of studies. That the
# defaults are the reader's is seen to by scenario_defaults_test.cc.
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
    /^\| `/ && NF == 7 && section != "" {
      keys = $2; gsub(/[`,]/, "", keys)
      example = $5; gsub(/`/, "", example)
      print section, start, keys, example
    }' "$document"
}

# What the program says to these keys. The scene that is given last does not exist, and nothing after the scenario is
# read: exit code 2 either way, and the message says which it was.
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

# The keys that the reader knows in a section, one a line: known_keys SECTION START BASE [ARGUMENT...].
known_keys() {
  local section=$1 start=$2 base=$3 prefix=
  shift 3
  [[ $section == - ]] || prefix=$section.
  [[ $start == - ]] || set -- --set "$start" "$@"
  ask "$base" "$@" --set "${prefix}surely_unknown_to_all=1" | told_keys
}
told_keys() { sed -nE 's/.*known here are (.*)$/\1/p' | tr -d ' ' | tr ',' '\n'; }
# The same for all that a section can be, less what is not in its table: types that head a table, and other tables.
all_known_keys() {
  local section=$1 start=$2
  case $section in
    -) known_keys - - paper | grep -vxE 'start_error|model|plant|grasp|trajectory|task|joint_motion|stance|control|controller|sensing|actuation|disturbance|mismatch|expect|bounds' ;;
    task) known_keys task - lift ;;
    joint_motion) known_keys joint_motion 'joint_motion={}' panda-reach ;;
    stance) known_keys stance - stand ;;
    # Keys that begin with model. are the parameter file's.
    model) ask paper --set 'model={ surely_unknown_to_all = 1 }' | told_keys ;;
    control)
      known_keys control - paper
      known_keys control 'control={ K_p = 1, K_v = 1, f_max = 50, mu = 0.6 }' paper
      ;;
    disturbance.0)
      known_keys disturbance.0 "$start" paper
      known_keys disturbance.0 'disturbance=[{ type = "sine", body = "object", frequency = 1 }]' paper
      ;;
    trajectory) known_keys trajectory "$start" paper | grep -vx type ;;
    *) known_keys "$section" "$start" paper ;;
  esac | sort -u
}

declare -A batches sections
count=0
while IFS=$'\t' read -r section start keys example; do
  prefix=$section.
  [[ $section != - ]] || prefix=
  number=0
  for key in $keys; do
    number=$((number + 1))
    count=$((count + 1))
    batches["$section|$start|$number"]+="$prefix$key=$example"$'\n'
    sections["$section|$start"]+=$key$'\n'
  done
done < <(list_keys)
[[ $count -ge 80 ]] || fail "only $count keys are found in $document"
for batch in "${!batches[@]}"; do
  IFS='|' read -r section start number <<<"$batch"
  base=paper
  [[ $section != task ]] || base=lift
  [[ $section != joint_motion ]] || base=panda-reach
  [[ $section != stance ]] || base=stand
  arguments=()
  [[ $start == - ]] || arguments+=(--set "$start")
  # K_p and K_v, and an angle in degrees, stand in the place of what paper.toml has.
  [[ $section/$number != control/2 ]] || arguments+=(--set "control={ f_max = 50, mu = 0.6 }")
  [[ $section != joint_motion ]] || arguments+=(--set "joint_motion={}")
  [[ $section/$number != expect/2 ]] || arguments+=(--set "expect={ from = 0 }")
  while IFS= read -r assignment; do
    [[ -z $assignment ]] || arguments+=(--set "$assignment")
  done <<<"${batches[$batch]}"
  accepts "$base" "${arguments[@]}" || fail "[$section] is refused with the examples of $document"
done

for section in "${!sections[@]}"; do
  all_known_keys "${section%%|*}" "${section#*|}" >known
  [[ -s known ]] || fail "the reader lists no keys of [${section%%|*}]"
  sort -u <<<"${sections[$section]%$'\n'}" | diff - known >difference ||
    fail "[${section%%|*}] has other keys in $document (<) and in the reader (>):"$'\n'"$(cat difference)"
done

# Keys and choices are texts of letters and _ in the reader's sources, or KEY(name): explain_all DOCUMENT LEAST SOURCE...
explain_all() {
  local explained=$1 least=$2 words word
  shift 2
  mapfile -t words < <(sed -E 's://.*::; s/KEY\(([a-z_]+)\)/"\1"/g' "$@" | grep -vE '^#' | grep -oE '"[A-Za-z][A-Za-z_]*"' | tr -d '"' | sort -u)
  [[ ${#words[@]} -ge $least ]] || fail "only ${#words[@]} keys are found in $*"
  for word in "${words[@]}"; do
    grep -qE "[\`\"[]$word[\`\"]|\`\[$word\]|\`\[\[$word\]\]|[|] $word [|]|[{ ,]$word = " "$explained" ||
      fail "$explained does not explain $word"
  done
  total=$((total + ${#words[@]}))
}
total=0
mapfile -t readers < <(find "$root/harness" -name 'scenario*.cc' -o -name 'scenario*.h' | sort)
explain_all "$document" 80 "${readers[@]}" "$root/controller/control/trajectory.cc"
explain_all "$root/harness/shipped/studies/README.md" 35 "$root/harness/study/study.cc" "$root/harness/study/objective.h"

[[ $status -ne 0 ]] || echo "$count keys of the document are accepted, $total of the readers are explained"
exit $status
