#!/usr/bin/env bash
# Builds somebody else's programs against an installed dexcheck and compares what they compute with the program's answer:
# consumer_test.sh BUILD CMAKE
set -euo pipefail

build=$1
cmake=$2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
fail() {
  echo "$*"
  exit 1
}

"$cmake" --install "$build" --prefix "$scratch/installed" >"$scratch/install.txt" || fail "$(tail -5 "$scratch/install.txt")"
mv "$scratch/installed" "$scratch/prefix"
robot=$root/controller/parameters/panda.toml
sed 's/^gravity = .*/gravity = [0, 0, -9.8]/' "$robot" >"$scratch/wrong.toml"
# No flag of this project reaches a consumer, so its own strictness must find nothing in the headers.
CXX=clang++ CC=clang "$cmake" -S "$here" -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$scratch/prefix" \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS="-Wall -Wextra -Wpedantic -Werror" \
  -DROBOT_TOML="$robot" -DROBOT_MJCF="$root/mjcf/panda.xml" -DWRONG_TOML="$scratch/wrong.toml" \
  -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >"$scratch/configure.txt" 2>&1 || fail "$(tail -20 "$scratch/configure.txt")"
! grep -q -- -Wconversion "$scratch/build/compile_commands.json" || fail "this project's warnings reach its consumers"
! grep -q "$root/\(controller\|harness\)" "$scratch/build/compile_commands.json" || fail "the consumer needs the sources"
"$cmake" --build "$scratch/build" >"$scratch/build.txt" 2>&1 || fail "$(tail -30 "$scratch/build.txt")"

# The same matrices from the program.
"$scratch/build/print_terms" "$robot" >"$scratch/terms.txt"
awk 'NR == 1 { gsub(/ +/, ","); sub(/^,/, ""); print "{\"q\":[" $0 "],\"xi\":[1,1,1,1,1,1,1]}" }' \
  "$scratch/terms.txt" >"$scratch/state.json"
"$scratch/prefix/bin/dexcheck" eval "$robot" --state "$scratch/state.json" --out "$scratch/eval.json"
paste <(tail -n +2 "$scratch/terms.txt" | tr -s ' ' '\n' | grep .) \
  <(awk '/"M_bar"|"C_bar"/ { inside = 1 } /^ ]/ { inside = 0 } inside' "$scratch/eval.json" | grep -oE '^ +-?[0-9][^,]*' |
    tr -d ' ') >"$scratch/both.txt"
awk '{ d = $1 - $2; if (d < 0) d = -d; if (NF != 2 || d > 1e-14) { print "print_terms and dexcheck eval differ: " $0; bad = 1 } }
  END { exit bad || NR != 98 }' "$scratch/both.txt" || fail "of $(wc -l <"$scratch/both.txt") numbers"

"$scratch/build/compare_robot" "$robot" "$root/mjcf/panda.xml" || fail "compare_robot does not agree"
! "$scratch/build/compare_robot" "$scratch/wrong.toml" "$root/mjcf/panda.xml" || fail "compare_robot agrees with a wrong gravity"

# Tests of the consumer's own.
(cd "$scratch/build" && ctest --output-on-failure --no-tests=error) >"$scratch/ctest.txt" || fail "$(cat "$scratch/ctest.txt")"
grep -q 'consistency.panda.panda' "$scratch/ctest.txt" || fail "dexcheck_add_consistency_test added no test"
grep -q '<testcase classname="dexcheck.consistency.panda.term" name="M_bar">' "$scratch/build/panda.xml" || fail "no JUnit file"
