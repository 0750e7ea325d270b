#!/usr/bin/env bash
# Follows the tutorial in a copy of its folder: tutorial_test.sh DEXCHECK PYTHON. The commands of each ```sh block of its README
# run in order, and the ```text block behind one is their whole output, in which a line "..." stands for any lines. The other
# blocks show lines of the folder's files.
set -euo pipefail

folder=$(cd "$(dirname "${BASH_SOURCE[0]}")/../harness/examples/tutorial" && pwd)
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
fail() {
  echo "README.md:$first_line: $*"
  exit 1
}

# Two differences are allowed: the seconds that a comparison took, and numbers below 1e-9, which are rounding, with the count of
# agreeing digits behind them.
normalise() {
  sed -E 's/(random states \(seed 1\)), [0-9.]+ s$/\1, T s/; s/[0-9]\.[0-9]+e-(09|[1-9][0-9])/TINY/g; s/TINY +1[0-9]  ok/TINY N ok/'
}

# Compare SHOWN REAL: 1 with a message unless the lines shown are the real ones, from the first to the last.
compare() {
  local line skips=0 next=0
  local -a real
  mapfile -t real <"$2"
  while IFS= read -r line; do
    if [[ $line == ... ]]; then
      skips=1
      continue
    fi
    while ((skips && next < ${#real[@]})) && [[ ${real[next]} != "$line" ]]; do next=$((next + 1)); done
    if [[ $next -ge ${#real[@]} || ${real[next]} != "$line" ]]; then
      echo "the output has no \"$line\" at its line $((next + 1))"
      return 1
    fi
    skips=0
    next=$((next + 1))
  done <"$1"
  ((skips || next == ${#real[@]})) || { echo "the output goes on: \"${real[next]}\"" && return 1; }
}

# What must be found: the test can fail.
printf 'a\nb\nc\n' >"$scratch/real"
for shown in '...\nb\nc' 'a\n...\nc' 'a\n...'; do
  compare <(printf '%b\n' "$shown") "$scratch/real" || { echo "$shown is not found" && exit 1; }
done
for shown in 'a\nc' 'a\nb' 'b\nc' '...\nd\n...' 'a\nb\nc\nd'; do
  ! compare <(printf '%b\n' "$shown") "$scratch/real" >"$scratch/message" || { echo "$shown is found" && exit 1; }
done

mkdir "$scratch/bin"
ln -s "$(realpath "$1")" "$scratch/bin/dexcheck"
ln -s "$(realpath "$2")" "$scratch/bin/python3"
export PATH=$scratch/bin:$PATH PYTHONDONTWRITEBYTECODE=1
cp -r "$folder" "$scratch/copy"
cd "$scratch/copy"

# Blocks as files N.LANGUAGE, whose first line is the number of the line where the block begins.
awk -v folder="$scratch" '
  /^```./ { file = sprintf("%s/%03d.%s", folder, ++blocks, substr($0, 4)); print NR > file; next }
  /^```/ { file = ""; next }
  file { print > file }' README.md
commands=0
outputs=0
for block in "$scratch"/[0-9]*.*; do
  first_line=$(head -1 "$block")
  tail -n +2 "$block" >"$scratch/block"
  case $block in
    *.sh)
      status=0
      bash -e "$scratch/block" >"$scratch/output" 2>&1 || status=$?
      ((status <= 1)) || fail "exit code $status: $(cat "$scratch/output")"
      commands=$((commands + 1))
      ;;
    *.text)
      compare <(normalise <"$scratch/block") <(normalise <"$scratch/output") >"$scratch/message" ||
        fail "$(cat "$scratch/message"): the whole output is"$'\n'"$(cat "$scratch/output")"
      outputs=$((outputs + 1))
      ;;
    *)
      while IFS= read -r line; do
        grep -qrxF --exclude=README.md -- "$line" "$folder" || fail "no file has the line \"$line\""
      done <"$scratch/block"
      ;;
  esac
done
((commands >= 10 && outputs >= 10)) || fail "only $commands commands and $outputs outputs"
echo "$commands commands, $outputs outputs as shown"
