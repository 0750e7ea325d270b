#!/usr/bin/env bash
# Installs what is missing, builds dexcheck and compares model and engine at 10000 random states; arguments go to
# `dexcheck consistency`:
#   harness/quickstart.sh [--robot FILE.toml --mjcf FILE.xml] [--seed N] ...
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}

"$root/harness/install-packages.sh"
(cd "$root" && cmake --preset release && cmake --build --preset release --target dexcheck)
exec "$root/build/release/bin/dexcheck" consistency "$@"
