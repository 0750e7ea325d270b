#!/usr/bin/env bash
# Installs what is missing, builds dexcheck and simulates the paper's experiment; arguments go to `dexcheck run`:
#   harness/quickstart.sh [SCENARIO] [--set KEY=VALUE] ...
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}

# The paper's experiment, unless the arguments name another or ask for something else.
scenario=(paper)
is_value=
for word in "$@"; do
  if [[ -n $is_value ]]; then
    is_value=
    continue
  fi
  case $word in
    --set | --seed | --out) is_value=yes ;;
    --list | --replay | --replay=* | --help | -h) scenario=() ;;
    -*) ;;
    *) scenario=() ;;
  esac
done

"$root/harness/install-packages.sh"
(cd "$root" && cmake --preset program && cmake --build --preset program)
exec "$root/build/release/bin/dexcheck" run "${scenario[@]}" "$@"
