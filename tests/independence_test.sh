#!/usr/bin/env bash
# Fails when sources name the physics engine or an archive needs it: independence_test.sh FOLDER ARCHIVE NM
# Exit code: 0 independent, 1 not, 2 nothing to look at.
set -euo pipefail

folder=$1
archive=$2
nm=$3

# The engine's name, its types (mjModel, mjtNum), its functions (mj_step, mju_copy), and the folders that may use them.
engine='(?i:mujoco)|\bmjt?[A-Z]|\bmj(|c|cb|d|r|s|u|ui|v)_|#\s*include\s*"(harness|renders|tests)/'

mapfile -t files < <(find "$folder" -type f \( -name '*.h' -o -name '*.cc' -o -name 'CMakeLists.txt' -o -name '*.cmake' \))
[[ ${#files[@]} -gt 1 ]] || { echo "no sources in $folder"; exit 2; }
symbols=$("$nm" --undefined-only "$archive")
[[ $(grep -c ' U ' <<<"$symbols") -gt 0 ]] || { echo "no undefined symbols in $archive"; exit 2; }

status=0
if grep -nP "$engine" "${files[@]}"; then
  echo "$folder names the engine"
  status=1
fi
if grep -E ' U mj[a-z]{0,2}_' <<<"$symbols" | sort -u; then
  echo "$archive needs the engine"
  status=1
fi
[[ $status -ne 0 ]] || echo "${#files[@]} files and $archive are independent of the engine"
exit $status
