#!/usr/bin/env bash
# Checks format and code without changing anything: clang-format looks at every source of the project, eslint at the
# pages' scripts, the check of comments, cppcheck and clang-tidy at the sources of controller/, harness/ and renders/ that
# are asked for:
#   tests/lint.sh                     all
#   tests/lint.sh SOURCE.cc...        these
#   tests/lint.sh --since REV [MOST]  those changed since this commit of git, at most MOST of them, the largest changes first
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
harness/install-packages.sh development
failed=0
sources=("$@")
commented=("$@")  # with headers, all of them
folders=('controller/*.cc' 'harness/*.cc' 'renders/*.cc')
headers=("${folders[@]/%.cc/.h}")
if [[ ${1:-} == --since ]]; then
  git rev-parse --quiet --verify "$2^{commit}" >/dev/null || { echo "lint: $2: no such commit here" >&2; exit 2; }
  mapfile -t sources < <(git diff --numstat --no-renames --diff-filter=d "$2" -- "${folders[@]}" | sort -rn | cut -f 3)
  mapfile -t commented < <(git diff --name-only --no-renames --diff-filter=d "$2" -- "${folders[@]}" "${headers[@]}")
  if [[ ${#sources[@]} -gt ${3:-1000000} ]]; then
    echo "${#sources[@]} sources have changed since $2; cppcheck and clang-tidy look at $3 of them"
    sources=("${sources[@]:0:$3}")
  fi
elif [[ $# -eq 0 ]]; then
  mapfile -t sources < <(git ls-files "${folders[@]}")
  mapfile -t commented < <(git ls-files "${folders[@]}" "${headers[@]}")
fi

# Lists comments that begin with a word that is no subject; fails if there are any.
check_comments() {
  ! grep -nE '^[[:space:]]*//[/<]* *(Of|What|As|Likewise)\b' /dev/null "$@"
}
# Words that readers had to decode; old logs have signals of such names.
check_words() {
  ! grep -nwE '[Tt]old|[Tt]ells?|alike|likewise|what is left|leaves? open|not meant' /dev/null "$@" | grep -vF '"told'
}

echo "clang-format"
git ls-files '*.cc' '*.h' | xargs clang-format-14 --dry-run --Werror || failed=1

echo "eslint"
# Names that the pages' scripts share: those of libraries, and what dom.js and charts.js define for all. Debian's Node
# finds Debian's modules by itself, another one does so by NODE_PATH.
shared=$(sed -nE 's/^(const|function) ([A-Za-z]+).*/\2/p' harness/report/page/dom.js harness/report/page/charts.js)
globals=Chart,THREE,$(tr '\n' , <<<"$shared")
git ls-files 'harness/*.js' | NODE_PATH=${NODE_PATH:-/usr/share/nodejs} xargs eslint --no-eslintrc --format unix \
  --parser-options=ecmaVersion:2022 --env browser,es2020 --global "${globals%,}" --rule "{no-undef: error, no-const-assign: error,
  no-dupe-keys: error, no-redeclare: [error, {builtinGlobals: false}], no-unreachable: error, no-unused-vars: [error, {varsIgnorePattern: '^(${shared//$'\n'/|})$'}],
  use-isnan: error, valid-typeof: error}" || failed=1

echo "comments"
check_comments "${commented[@]}" || failed=1
check_words $(git ls-files 'controller/*.cc' 'controller/*.h' 'harness/*.cc' 'harness/*.h' 'renders/*.cc' 'renders/*.h') || failed=1

[[ ${#sources[@]} -gt 0 ]] || exit "$failed"

echo "cppcheck"
# Suppressed, with reasons:
# - missingReturn: cppcheck does not follow the [[noreturn]] of a member of another class; clang does (-Wreturn-type).
# - legacyUninitvar: cppcheck takes `x = new (std::nothrow) T{}` for no initialisation; clang's analyzer looks for the
#   real ones.
# - missingInclude, missingIncludeSystem: the headers of libraries are not given.
# - syntaxError in the Python module: so it cannot know PYBIND11_MODULE.
# - syntaxError in sqlite_file.cc: it does not know a constructor that is one try block.
# - invalidLifetime in text.h: it takes a number that ParseNumber has read for a view of the text.
cppcheck --quiet --std=c++20 --language=c++ --enable=warning,performance,portability --error-exitcode=1 -I "$root" \
  --suppress=missingReturn --suppress=legacyUninitvar --suppress=missingInclude --suppress=missingIncludeSystem \
  '--suppress=invalidLifetime:*controller/common/text.h' --suppress=syntaxError:harness/python/module.cc --suppress=syntaxError:harness/study/sqlite_file.cc "${sources[@]}" || failed=1

echo "clang-tidy"
# Headers are precompiled by a build only, and none is needed here; each source is looked at by itself.
cmake --preset release -B build/lint -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DCMAKE_UNITY_BUILD=OFF >/dev/null
# Only findings in this project count: the analyzer also reports what it supposes inside Eigen's headers. A source that
# cannot be compiled is a finding wherever the error is.
findings=$(printf '%s\n' "${sources[@]}" |
  xargs -n 1 -P "$(nproc)" clang-tidy-14 -p build/lint --quiet 2>/dev/null |
  grep -E "^$root/.*(warning|error):|error: .*\[clang-diagnostic-error\]" | sort -u) || true
if [[ -n $findings ]]; then
  echo "$findings"
  failed=1
fi
exit "$failed"
