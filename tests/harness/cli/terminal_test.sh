#!/usr/bin/env bash
# What a user sees in a terminal: terminal_test.sh DEXCHECK
# Progress never wraps (tmux at three widths), colours respect NO_COLOR, passing checks are folded, and
# bash completes words.
set -euo pipefail

command -v tmux >/dev/null || { echo "skipped: no tmux here"; exit 77; }

dexcheck=$1
work=$(mktemp -d)
socket=$work/tmux
trap 'tmux -S "$socket" kill-server 2>/dev/null || true; rm -rf "$work"' EXIT
fail() {
  echo "terminal_test: $*"
  exit 1
}
cd "$work"
ln -s "$dexcheck" dexcheck
PATH=$work:$PATH

# A run of some seconds whose progress is looked at several times.
for columns in 60 80 200; do
  socket=$work/tmux$columns  # a server's socket outlives the server a little
  tmux -S "$socket" -f /dev/null new-session -d -x "$columns" -y 12 "PS1='> ' bash --norc --noprofile"
  tmux -S "$socket" send-keys "dexcheck run paper --set duration=60 --no-log --no-check; echo ended" Enter
  seen=0
  estimated=0
  begin=
  for _ in {1..200}; do
    sleep 0.1
    screen=$(tmux -S "$socket" capture-pane -p)
    bars=$(grep -c '\[[#.]*\] *[0-9]* %' <<<"$screen" || true)
    percent=$(grep -c ' %' <<<"$screen" || true)
    [[ $bars -le 1 && $percent -le 1 ]] || fail "at $columns columns the progress wraps: $screen"
    [[ $bars -eq 0 ]] || seen=$((seen + 1))
    now=${EPOCHREALTIME/[.,]/}  # us
    [[ $bars -eq 0 || -n $begin ]] || begin=$now
    if left=$(grep -oE '[0-9]+ s left' <<<"$screen"); then
      estimated=$((estimated + 1))
      share=$(grep -oE '[0-9]+ %' <<<"$screen")
      share=${share%% *}
      # On a busy machine all takes long; what is left goes with what is done. 1 % may be half of one.
      pace=$(((now - begin) * (100 - share) / (share > 0 ? share : 1) / 1000000))
      [[ $share -eq 0 || ${left%% *} -le $((4 * pace + 10)) ]] || fail "a wild estimate at $share %: $left, by the pace $pace s"
    fi
    [[ $seen -lt 12 || $estimated -lt 3 ]] || break
  done
  [[ $seen -ge 5 && $estimated -ge 1 ]] || fail "no progress was seen at $columns columns: $screen"
  tmux -S "$socket" kill-server
done

# Colours on a terminal, unless NO_COLOR is set; none in a pipe.
run=(dexcheck run paper --set duration=0.01 --no-log)
colours() { script -qec "$*" /dev/null | grep -c $'\033\[[0-9;]*m' || true; }
[[ $(TERM=xterm colours "${run[@]}") -gt 0 ]] || fail "no colours on a terminal"
[[ $(NO_COLOR=1 TERM=xterm colours "${run[@]}") -eq 0 ]] || fail "colours in spite of NO_COLOR"
[[ $("${run[@]}" | grep -c $'\033') -eq 0 ]] || fail "colours in a pipe"

# Passing checks: a line for each question; --all lists them; what fails is always listed.
"${run[@]}" >folded.txt
"${run[@]}" --all >all.txt
for question in model law inverse forward assumption; do
  [[ $(grep -cE "^$question +([0-9]+ +)?[a-z_]" folded.txt) -ge 1 ]] || fail "no line for $question: $(cat folded.txt)"
done
[[ $(grep -cE ' ok$' folded.txt) -eq 6 ]] || fail "passing checks are not folded: $(cat folded.txt)"
[[ $(grep -cE ' ok$' all.txt) -gt 25 ]] || fail "--all does not list the checks: $(cat all.txt)"
"${run[@]}" --set bounds.cone_use=0.01 >failing.txt && fail "a bound of 0.01 holds"
grep -qE '^assumption +cone_use .*FAILS' failing.txt || fail "a failing check is folded away: $(cat failing.txt)"
"${run[@]}" --json | python3 -c 'import json, sys; s = json.load(sys.stdin); assert s["verdict"] == "pass" and s["checks"]["M_bar"]["pass"]' ||
  fail "--json is not the summary"

# bash completes commands, options and scenarios.
dexcheck completion bash >completion.bash
complete_words() {
  bash --norc -c '. ./completion.bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); compopt() { :; }; _dexcheck; printf "%s\n" "${COMPREPLY[@]}"' bash "$@"
}
grep -qx consistency <<<"$(complete_words dexcheck con)" || fail "bash does not complete a command"
grep -qx -- --no-report <<<"$(complete_words dexcheck run --no)" || fail "bash does not complete an option"
grep -qx paper-rest <<<"$(complete_words dexcheck run pap)" || fail "bash does not complete a scenario"
grep -qx run <<<"$(complete_words dexcheck study r)" || fail "bash does not complete a command of study"
echo "progress, colours, folded checks and completion are right"
