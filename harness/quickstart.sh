#!/usr/bin/env bash
# Installs what is missing, builds dexcheck and simulates the paper's experiment; arguments go to `dexcheck run`:
#   harness/quickstart.sh [SCENARIO [--set KEY=VALUE] ...]
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}

"$root/harness/install-packages.sh"
(cd "$root" && cmake --preset release && cmake --build --preset release --target dexcheck)
exec "$root/build/release/bin/dexcheck" run "${@:-paper}"
