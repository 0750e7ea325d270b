#!/usr/bin/env bash
# What action.yml runs: unpacks DEXCHECK_ARCHIVE, or builds dexcheck, unless DEXCHECK names a program, and compares DEXCHECK_A
# with DEXCHECK_B. The verdict goes into the job's summary; the exit code is dexcheck's.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)
if [[ -n ${DEXCHECK_ARCHIVE:-} ]]; then
  unpacked=$(mktemp -d)
  trap 'rm -rf "$unpacked"' EXIT
  curl --fail --silent --show-error --location --retry 3 --output "$unpacked/archive" "$DEXCHECK_ARCHIVE" ||
    { echo "::error::$DEXCHECK_ARCHIVE: cannot be had"; exit 2; }
  [[ -z ${DEXCHECK_SHA256:-} ]] || sha256sum --check --quiet <<<"$DEXCHECK_SHA256  $unpacked/archive" >/dev/null 2>&1 ||
    { echo "::error::$DEXCHECK_ARCHIVE: its SHA-256 is not $DEXCHECK_SHA256"; exit 2; }
  tar -xf "$unpacked/archive" -C "$unpacked" --strip-components=1
  DEXCHECK=$unpacked/bin/dexcheck
elif [[ -z ${DEXCHECK:-} ]]; then
  "$root/harness/install-packages.sh"
  (cd "$root" && cmake --preset program && cmake --build --preset program)
  DEXCHECK=$root/build/release/bin/dexcheck
fi
summary=${GITHUB_STEP_SUMMARY:-/dev/null}
worst=0

# Run TITLE ARGUMENTS...: what dexcheck prints goes into the log and into the summary.
Run() {
  local title=$1 status=0 output
  shift
  output=$("$DEXCHECK" "$@" 2>&1) || status=$?
  printf '%s\n' "$output"
  printf '### %s\n\n```\n%s\n```\n' "$title" "$output" >>"$summary"
  ((status <= worst)) || worst=$status
}

if [[ ${DEXCHECK_AUDIT:-false} == true ]]; then
  Run "audit of $DEXCHECK_A" audit "$DEXCHECK_A"
  Run "audit of $DEXCHECK_B" audit "$DEXCHECK_B"
fi
read -r -a arguments <<<"${DEXCHECK_ARGUMENTS:-}"
Run "$DEXCHECK_A against $DEXCHECK_B" consistency "$DEXCHECK_A" "$DEXCHECK_B" --junit "${DEXCHECK_JUNIT:-dexcheck.xml}" \
  "${arguments[@]}"
[[ $worst -eq 0 ]] || echo "::error::$DEXCHECK_A and $DEXCHECK_B: dexcheck found a difference (exit code $worst)"
exit "$worst"
