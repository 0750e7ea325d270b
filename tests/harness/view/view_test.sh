#!/usr/bin/env bash
# The window of `dexcheck view`, on a display of its own, with keys pressed and the mouse moved by xdotool:
# view_test.sh DEXCHECK [FOLDER for screenshots]
set -euo pipefail

for program in Xvfb xdotool import; do
  command -v $program >/dev/null || { echo "skipped: no $program here"; exit 77; }
done

dexcheck=$1
work=$(mktemp -d)
shots=${2:-$work}
viewer=
server=
cleanup() {
  [[ -z $viewer ]] || kill "$viewer" 2>/dev/null || true
  [[ -z $server ]] || kill "$server" 2>/dev/null || true
  rm -rf "$work"
}
trap cleanup EXIT
fail() {
  echo "view_test: $*"
  cat "$work/viewer.txt" 2>/dev/null || true
  exit 1
}

exec {display}> >(cat >"$work/display")
Xvfb -displayfd "$display" -screen 0 1280x800x24 -nolisten tcp 2>/dev/null &
server=$!
for _ in {1..100}; do [[ ! -s $work/display ]] || break; sleep 0.1; done
DISPLAY=:$(cat "$work/display")
export DISPLAY
cd "$work"

title() { xdotool getwindowname "$window" 2>/dev/null || true; }
# Waits until the window's title has this word.
await() {
  for _ in {1..600}; do
    [[ $(title) != *"$1"* ]] || return 0
    kill -0 "$viewer" 2>/dev/null || fail "it ended before its title had \"$1\""
    sleep 0.1
  done
  fail "the title has no \"$1\": $(title)"
}
# Opens the window: start ARGUMENTS.
start() {
  "$dexcheck" view "$@" --size 800x480 >"$work/viewer.txt" 2>&1 &
  viewer=$!
  window=$(timeout 60 xdotool search --sync --onlyvisible --name '^dexcheck ' | head -1) || fail "no window"
  xdotool windowmove "$window" 0 0 windowfocus --sync "$window"
}
# Ends it with the key q: end EXIT_CODES.
end() {
  local code=0
  xdotool key q
  wait "$viewer" || code=$?
  viewer=
  [[ " $* " == *" $code "* ]] || fail "exit code $code instead of $*"
}
shot() { import -window "$window" "$shots/$1.png"; }
# Time in the title, ms.
now() { title | sed -E 's/.* - ([0-9]+)\.([0-9]{3}) s - .*/\1\2/; s/^0+([0-9])/\1/'; }
# How much two screenshots differ, of 65535.
differ() { compare -metric MAE "$shots/$1.png" "$shots/$2.png" null: 2>&1 | sed 's/[. ].*//' || true; }

# Undisturbed, the log has the same bits as that of `run`, pauses and single steps notwithstanding.
start paper --set duration=0.06 --out live --paused
await paused
xdotool key Right Right Right
for _ in {1..300}; do [[ $(now) -lt 3 ]] || break; sleep 0.1; done
[[ $(now) -eq 3 ]] || fail "three steps after the first end at 3 ms, not $(now)"
xdotool key Left
sleep 0.3
[[ $(now) -eq 2 ]] || fail "a step back from 3 ms goes to $(now) ms"
xdotool key space
await finished
shot finished
end 0
"$dexcheck" run paper --set duration=0.06 --out ran --no-report --quiet >/dev/null
"$dexcheck" compare live ran --tolerance 0 >compared.txt || fail "its log differs from that of run: $(cat compared.txt)"
"$dexcheck" run --replay live --quiet >replayed.txt || fail "it does not replay: $(cat replayed.txt)"

platform=(393 325)  # where it is seen
# A pull at the object is a disturbance that the judge knows, that replays and that is saved.
start paper --set duration=60 --set expect.position=1 --set expect.orientation=1 --out pulled --paused --save saved.toml
await paused
xdotool key g
sleep 0.6
shot before
# The tube of the torus, nearest to the camera: a little below the picture's middle.
xdotool mousemove 400 276 keydown ctrl mousedown 1 sleep 0.3 keyup ctrl mousemove 402 276 mousemove 470 216
sleep 0.4
xdotool key space
for _ in {1..300}; do [[ $(now) -lt 250 ]] || break; sleep 0.1; done
shot pulling
xdotool mouseup 1
xdotool key space
await paused
shot after
# The wheel brings the camera away; then a link, the platform at the picture's lower middle, is pulled.
for _ in {1..16}; do xdotool click 5; done
sleep 0.6
shot away
[[ $(differ after away) -gt 60 ]] || fail "the wheel does not move the camera"
xdotool mousemove "${platform[@]}" keydown ctrl mousedown 1 sleep 0.3 keyup ctrl mousemove_relative -- 1 0 mousemove_relative -- 3 -1
begin=$(now)
xdotool key space
for _ in {1..300}; do [[ $(now) -lt $((begin + 100)) ]] || break; sleep 0.1; done
shot link
xdotool mouseup 1 key s
for _ in {1..300}; do [[ ! -s saved.toml ]] || break; sleep 0.1; done
xdotool key space
await paused
# Back to what was: a live run is scrubbed, and goes on at its end.
end=$(now)
xdotool key Left Left Left
for _ in {1..300}; do [[ $(now) -gt $((end - 3)) ]] || break; sleep 0.1; done
[[ $(now) -eq $((end - 3)) ]] || fail "three steps back from $end ms go to $(now) ms"
xdotool key Right Right Right Right Right
for _ in {1..300}; do [[ $(now) -lt $((end + 2)) ]] || break; sleep 0.1; done
[[ $(now) -eq $((end + 2)) ]] || fail "five steps on from there go to $(now) ms instead of $((end + 2))"
end 0 1  # a strong pull may break an assumption
pulls=$(grep -o 'pulse' saved.toml | wc -l) || true
[[ $pulls -ge 3 ]] || fail "only $pulls pulls were saved: $(head -c 2000 saved.toml)"
grep -qE "force = \[ *-?[0-9.e-]*[1-9]" saved.toml || fail "pulls without force: $(head -c 2000 saved.toml)"
grep -q "body = 'object'" saved.toml || fail "the object was not pulled: $(head -c 2000 saved.toml)"
grep 'body = ' saved.toml >bodies.txt
grep -qv "body = 'object'" bodies.txt || fail "no link was pulled: $(head -c 2000 saved.toml)"
[[ $(differ before after) -gt 60 ]] || fail "the picture did not change"
# The judge knows the pulls: without that, the balances would be off by far more than their bounds.
for balance in inverse_dynamics_robot inverse_dynamics_object; do
  grep -A12 "\"$balance\"" pulled/summary.json | grep '"pass": true' >/dev/null || fail "$balance does not know the pull"
done
"$dexcheck" run --replay pulled --quiet >replayed.txt || fail "a pulled run does not replay: $(cat replayed.txt)"
# What was saved is the same run.
rows=$("$dexcheck" export pulled --signals time --csv - | wc -l)
"$dexcheck" run saved.toml --out again --no-report --quiet --set duration="$(((rows - 1) / 100))e-1" >/dev/null || [[ $? -eq 1 ]] || fail "the saved scenario does not run"
"$dexcheck" export again --signals 'engine/qpos,tau' --csv again.csv
"$dexcheck" export pulled --signals 'engine/qpos,tau' --csv pulled.csv
head -n "$(wc -l <again.csv)" pulled.csv | cmp - again.csv || fail "the saved scenario gives other numbers"
[[ $(wc -l <again.csv) -gt 200 ]] || fail "the saved scenario is short"

# A slider gives other gains: the run begins anew with them, and is saved with them.
start paper --set duration=60 --out slid --save slid.toml --paused
await paused
xdotool mousemove 672 44 mousedown 1 mousemove 700 44 mousemove 722 44 sleep 0.3
shot slider
xdotool mouseup 1
await running
for _ in {1..300}; do [[ $(now) -lt 20 ]] || break; sleep 0.1; done
xdotool key space
await paused
xdotool key s
for _ in {1..300}; do [[ ! -s slid.toml ]] || break; sleep 0.1; done
# As in MuJoCo's simulate, Backspace begins anew.
xdotool key BackSpace
await running
end 0
# A quarter of the slider's way to the right is twice the stiffness: omega' = sqrt(2) omega, and the damping K_v stays.
python3 - slid.toml <<'PYTHON' || fail "the slider's gains were not saved: $(cat slid.toml)"
import re, sys
text = open(sys.argv[1]).read()
def first(key):
    return float(re.search(key + r"\s*=\s*\[?\s*([0-9.e-]+)", text).group(1))
omega, zeta = first("natural_frequency"), first("damping_ratio")
assert abs(omega / 20 - 2 ** 0.5) < 0.02, omega
assert abs(omega * zeta - 20) < 1e-6, (omega, zeta)
PYTHON
"$dexcheck" run --replay slid --quiet >replayed.txt || fail "a run with other gains does not replay: $(cat replayed.txt)"

# An arm holds nothing: a place where there was a slider for f_min has none, and what is saved has short numbers.
start panda-reach --set duration=60 --save arm.toml --paused
await paused
xdotool mousemove 672 124 mousedown 1 mousemove 722 124 sleep 0.3 mouseup 1
sleep 0.5
[[ $(title) == *paused* ]] || fail "an arm has a slider for f_min"
xdotool mousemove 672 44 mousedown 1 mousemove 700 44 mousemove 722 44 sleep 0.3 mouseup 1
await running
for _ in {1..300}; do [[ $(now) -lt 20 ]] || break; sleep 0.1; done
xdotool key space
await paused
xdotool key s
for _ in {1..300}; do [[ ! -s arm.toml ]] || break; sleep 0.1; done
end 0
grep -q FAILED viewer.txt && fail "closed early is no failure, and exit code 0 none either"
grep -q "CLOSED at" viewer.txt || fail "what was closed early does not say so"
grep -qE 'natural_frequency = .*28\.[0-9]+' arm.toml || fail "the arm's gains were not saved: $(cat arm.toml)"
! grep -E '[0-9]{16}' arm.toml || fail "long numbers were saved"
"$dexcheck" run arm.toml --set duration=0.02 --no-log --quiet >/dev/null || fail "the saved arm does not run"

# A recording is scrubbed: a click into the middle of its time line.
start ran --paused
await paused
xdotool mousemove 400 426 click 1
for _ in {1..300}; do [[ $(now) -lt 20 ]] || break; sleep 0.1; done
[[ $(now) -ge 25 && $(now) -le 35 ]] || fail "the middle of 60 ms is at $(now) ms"
# Something is drawn, which takes its time on a busy machine.
for _ in {1..100}; do
  shot recording
  [[ $(identify -format %k "$shots/recording.png") -lt 1000 ]] || break
  sleep 0.1
done
# Waits until a picture differs from that of the recording: shows NAME BY MESSAGE.
shows() {
  for _ in {1..100}; do
    shot "$1"
    [[ $(differ recording "$1") -le $2 ]] || return 0
    sleep 0.1
  done
  fail "$3"
}
# As in simulate, F1 shows the keys, Tab hides the controls, and Esc closes nothing.
xdotool key Escape F1
shows help 1000 "F1 shows no help"
xdotool key F1
for _ in {1..100}; do
  shot closed
  [[ $(differ recording closed) -gt 300 ]] || break
  sleep 0.1
done
shot recording
xdotool key Tab
shows bare 300 "Tab does not hide the controls"
end 0

# A controller of the user's own, which steps in a thread of the viewer's: its log is repeated bit for bit.
law=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)/harness/examples/numpy_joint_law.py
export DEXCHECK_PYTHON=/usr/bin/python3
start panda-reach --set duration=0.1 --set settle=0.05 --controller "$law" --out own
await finished
end 0
"$dexcheck" run --replay own --controller "$law" | grep -q IDENTICAL || fail "a run with a controller in Python is not repeated"

# Without a display: one line, exit code 2.
code=0
(unset DISPLAY WAYLAND_DISPLAY; "$dexcheck" view paper) >"$work/none.txt" 2>&1 || code=$?
[[ $code -eq 2 && $(wc -l <"$work/none.txt") -eq 1 ]] || fail "without a display: exit code $code, $(cat "$work/none.txt")"
echo "the window shows, steps, pulls, saves and replays"
