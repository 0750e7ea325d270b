#!/usr/bin/env bash
# Two programs, built with two releases of MuJoCo, on the same robots and scenarios: other_release_test.sh PROGRAM [OTHER]
# Exit code 77 where there is no other program.
set -euo pipefail

this=$(realpath "$1")
other=$(realpath -m "${2:-${DEXCHECK_OTHER_PROGRAM:-}}" 2>/dev/null || true)
[[ -x $other ]] || { echo "DEXCHECK_OTHER_PROGRAM names no program that was built with another release of MuJoCo"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

release() { "$1" version | grep -oE 'MuJoCo [0-9.]+' | head -1; }
[[ $(release "$this") != "$(release "$other")" ]] || { echo "both programs have $(release "$this")"; exit 1; }

for program in "$this" "$other"; do
  "$program" consistency --samples 200 --quiet
done
"$this" run paper --set duration=0.2 --set settle=0.2 --no-report --quiet --out a
"$other" run paper --set duration=0.2 --set settle=0.2 --no-report --quiet --out b

# Other settings are named; what should be the same is.
"$this" compare a b --json compared.json --quiet >/dev/null
python3 - <<'E2'
import json
compared = json.load(open('compared.json'))
inputs = compared['inputs']
assert inputs['mujoco_version'][0] != inputs['mujoco_version'][1], inputs
assert 'engine, features' in inputs, inputs
assert 'engine, integrator' not in inputs and 'engine, cone' not in inputs, inputs
for name in ('contacts of the engine, mean', 'its constraint rows, mean'):
    first, second = compared['results'][name]['values']
    assert first == second > 0, (name, first, second)
apart = {signal['name']: signal['difference'] for signal in compared['signals']}
assert 0 < apart['object/X_o'] < 1e-6, apart['object/X_o']
E2
