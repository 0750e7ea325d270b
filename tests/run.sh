#!/usr/bin/env bash
# Installs what is missing, builds and runs tests: tests/run.sh [PRESET], by default release, which builds everything and runs
# all tests. `fast` is for whoever works on the code: only the tests that start no process and take under a second each.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}

purpose=tests
[[ ${1:-} != sanitize && ${1:-} != thread ]] || purpose=development
"$root/harness/install-packages.sh" "$purpose"
cd "$root"
exec cmake --workflow --preset "${1:-release}"
