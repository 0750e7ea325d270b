#!/usr/bin/env bash
# Checks format and code without changing anything: tests/lint.sh [SOURCE.cc...], by default all of controller/,
# harness/ and renders/. clang-format looks at every source of the project, cppcheck and clang-tidy at those given.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
harness/install-packages.sh development
sources=("$@")
[[ ${#sources[@]} -gt 0 ]] || mapfile -t sources < <(git ls-files 'controller/*.cc' 'harness/*.cc' 'renders/*.cc')
failed=0

echo "clang-format"
git ls-files '*.cc' '*.h' | xargs clang-format-14 --dry-run --Werror || failed=1

echo "cppcheck"
# Suppressed, with reasons:
# - missingReturn: cppcheck does not follow the [[noreturn]] of a member of another class; clang does (-Wreturn-type).
# - legacyUninitvar: cppcheck takes `x = new (std::nothrow) T{}` for no initialisation; clang's analyzer looks for the
#   real ones.
# - missingInclude, missingIncludeSystem: the headers of libraries are not given.
cppcheck --quiet --std=c++20 --language=c++ --enable=warning,performance,portability --error-exitcode=1 -I "$root" \
  --suppress=missingReturn --suppress=legacyUninitvar --suppress=missingInclude --suppress=missingIncludeSystem "${sources[@]}" || failed=1

echo "clang-tidy"
cmake --preset release >/dev/null
# Only findings in this project count: the analyzer also reports what it supposes inside Eigen's headers.
findings=$(printf '%s\n' "${sources[@]}" |
  xargs -n 1 -P "$(nproc)" clang-tidy-14 -p build/release --quiet 2>/dev/null |
  grep -E "^$root/.*(warning|error):" | sort -u) || true
if [[ -n $findings ]]; then
  echo "$findings"
  failed=1
fi
exit "$failed"
