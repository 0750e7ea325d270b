#!/usr/bin/env bash
# The README's set-up as a new user meets it: its commands, in one clone of HEAD, on a bare Debian 12 and without HOME.
#   tests/fresh_machine.sh             as root, in the README's order
#   tests/fresh_machine.sh reversed    the other order, as nobody, for whom root has installed the packages
# Needs root and debootstrap; takes half an hour, so it is no part of the gate, but is run before a release.
set -euo pipefail

order=${1:-readme}
[[ $order == readme || $order == reversed ]] || { echo "fresh_machine: $order: must be readme or reversed" >&2; exit 2; }
# What is mounted here is gone with this process.
[[ -n ${DEXCHECK_OWN_MOUNTS:-} ]] || DEXCHECK_OWN_MOUNTS=1 exec unshare --mount "$0" "$@"

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
. "$repository/tests/bare_root.sh"
scratch=$(mktemp -d)
root=$scratch/root
trap 'umount --recursive --lazy "$root/dev" "$root/sys" "$root/proc" 2>/dev/null || true; rm -rf --one-file-system "$scratch"' EXIT

MakeBareRoot "$root"
mount -t proc proc "$root/proc"
# Chromium and slurmd look into /sys.
for folder in dev sys; do mount --rbind --make-rslave "/$folder" "$root/$folder"; done
clone=/var/tmp/dexcheck
git clone --quiet "file://$repository" "$root$clone"
echo "Commit $(git -C "$root$clone" rev-parse --short HEAD), bare Debian $(cat "$root/etc/debian_version"), order: $order"

mapfile -t commands < <(awk '/^```sh/ { code = 1; next } /^```/ { code = 0 } code' "$repository/README.md")
[[ ${#commands[@]} -eq 2 ]] || { echo "fresh_machine: README.md has ${#commands[@]} set-up commands, not two" >&2; exit 1; }
user=root
if [[ $order == reversed ]]; then
  user=nobody
  commands=("${commands[1]}" "${commands[0]}")
  chroot "$root" "$clone/harness/install-packages.sh" tests
  chroot "$root" chown -R nobody:nogroup "$clone"
fi

progress='^ +Start +[0-9]+: |^ *[0-9]+/[0-9]+ Test .* Passed |^\[[0-9]+/[0-9]+\] '
for command in "${commands[@]}"; do
  begin=$SECONDS
  echo "\$ $command    (as $user)"
  if [[ $user == root ]]; then who=(chroot); else who=(chroot --userspec=nobody:nogroup); fi
  set +e
  "${who[@]}" "$root" env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    sh -c "cd $clone && exec $command" </dev/null 2>&1 | grep --line-buffered -vE "$progress"
  code=${PIPESTATUS[0]}
  set -e
  echo "exit code $code after $(((SECONDS - begin) / 60)) min $(((SECONDS - begin) % 60)) s"
  [[ $code -eq 0 ]] || exit "$code"
done
