#!/usr/bin/env bash
# Fails when folders of the sources include one another in a cycle, or when a folder of harness/ includes a header of one
# that harness/CMakeLists.txt adds later, or when two headers define types of one name in one namespace, or when sources or
# tests use what differs between MuJoCo's releases by themselves: ladder_test.sh ROOT
# Exit code: 0 a ladder, 1 not, 2 nothing to look at.
set -euo pipefail

# Prints "FOLDER INCLUDED FILE" for each include of another folder of ROOT; examples are users' code.
list_includes() {
  (cd "$1" && find controller harness renders -type f \( -name '*.h' -o -name '*.cc' \) -not -path 'harness/examples/*' -exec \
    grep -HoE '^#include "(controller|harness|renders)/[^"]+"' {} +) |
    sed -E 's|^((.*)/[^/:]+):#include "(.*)/[^/]+"$|\2 \3 \1|' | awk '$1 != $2' | sort -u
}

# Prints what is wrong with the tree ROOT.
list_faults() {
  local includes order
  includes=$(list_includes "$1")
  awk '{ print $1, $2 }' <<<"$includes" | sort -u | tsort 2>&1 >/dev/null | sed -E 's/^tsort: -: //' |
    tr '\n' ' ' | sed -E 's/ $/\n/; s/^/folders include one another: /'
  order=$(sed -nE 's/^ *(add_subdirectory|dexcheck_add_library)\(([a-z]+)[ )].*/harness\/\2/p' "$1/harness/CMakeLists.txt")
  awk 'NR == FNR { height[$1] = NR; next }
    $1 ~ /^harness\// && !($1 in height) { print $3 ": its folder is not added by harness/CMakeLists.txt"; next }
    $2 in height && $1 in height && height[$2] > height[$1] { print $3 ": includes a header of " $2 ", which is above" }
    $1 ~ /^controller\// && $2 !~ /^controller\// { print $3 ": includes a header of " $2 }' \
    <(printf '%s\n' "$order") - <<<"$includes"
}

# Prints types that two headers of ROOT define in one namespace: of their members the linker keeps one.
list_twins() {
  (cd "$1" && find controller harness renders -name '*.h' -exec awk '
    FNR == 1 { space = "" }
    /^namespace [A-Za-z_:]+ \{/ { space = $2 }
    /^(struct|class|enum class) [A-Z][A-Za-z0-9]*[^;]*$/ { print space "::" ($1 == "enum" ? $3 : $2), FILENAME }' {} +) |
    sed 's/:* / /2; s/{//' | sort -u | awk '$1 == last { print file " and " $2 " both define " $1 } { last = $1; file = $2 }'
}

# Prints the lines of the tree ROOT that use what another release of MuJoCo says otherwise, but for the one header that
# knows the releases, and the list of its fields.
list_releases() {
  local members='qM|dof_Madr|eq_active|ten_J|mpr_iterations|mpr_tolerance|n?names_map|body_bvh[a-z]*|geom_plugin|body_gravcomp'
  local names='mj_fullM|mj_crb|mju_warningText|mj_makeEmptyFileVFS|mj_addBufferVFS|mjv_makeConnector|mjv_connector|mj_ray|mj_maxContact|mjCOL_[A-Z]+'
  (cd "$1" && grep -rnE "(->|\.)($members)\>|opt\.collision|mjENBL_SENSORNOISE|\<($names)\>" harness renders tests \
    --include='*.h' --include='*.cc' | grep -vE '^harness/engine/mujoco_release\.h:|^tests/harness/comparison/engine_fields\.h:') || true
}

root=$1
[[ $(list_includes "$root" | wc -l) -gt 100 ]] || { echo "no sources in $root"; exit 2; }

# What must be found: the test can fail.
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
mkdir -p "$scratch"/{controller/model,harness/base,harness/log,renders}
printf 'dexcheck_add_library(base)\nadd_subdirectory(log)\n' >"$scratch/harness/CMakeLists.txt"
echo '#include "harness/base/files.h"' >"$scratch/harness/log/writer.cc"
[[ -z $(list_faults "$scratch") ]] || { echo "a ladder is taken for none"; exit 1; }
echo '#include "harness/log/writer.h"' >"$scratch/harness/base/files.cc"
[[ $(list_faults "$scratch" | grep -c 'include one another.*harness/log\|files.cc: includes a header of harness/log') -eq 2 ]] ||
  { echo "a cycle is not found"; exit 1; }

mkdir "$scratch/tests"
echo 'mj_fullM(m, M, d->qM);' >"$scratch/tests/terms_test.cc"
[[ $(list_releases "$scratch" | wc -l) -eq 1 ]] || { echo "what differs between releases is not found"; exit 1; }

printf 'namespace a {\nstruct Twin {\n' | tee "$scratch/harness/base/one.h" >"$scratch/harness/log/other.h"
[[ $(list_twins "$scratch" | wc -l) -eq 1 ]] || { echo "two types of one name are not found"; exit 1; }

faults=$(list_faults "$root"; list_twins "$root"; list_releases "$root")
[[ -z $faults ]] || { echo "$faults"; exit 1; }
echo "$(list_includes "$root" | wc -l) includes between folders, no cycle"
