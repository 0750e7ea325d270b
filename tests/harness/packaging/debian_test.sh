#!/usr/bin/env bash
# Installs the program's Debian package on a bare Debian 12 and runs the paper's experiment there, from any folder and as
# nobody: debian_test.sh [BUILD], by default build/release. Needs root, debootstrap and dpkg-dev; takes some minutes, so it is
# no part of the gate.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)
build=$(realpath "${1:-$repository/build/release}")
. "$repository/tests/bare_root.sh"
scratch=$(mktemp -d)
root=$scratch/root
trap 'umount -q "$root/proc" || true; rm -rf --one-file-system "$scratch"' EXIT

(cd "$build" && cpack -G DEB -B "$scratch/packages" >"$scratch/cpack.txt") || { tail -20 "$scratch/cpack.txt"; exit 1; }
MakeBareRoot "$root"
cp "$scratch"/packages/dexcheck_*.deb "$root/tmp/"
chroot "$root" sh -c 'DEBIAN_FRONTEND=noninteractive apt-get --quiet=2 update &&
  apt-get --quiet=2 --yes install --no-install-recommends /tmp/dexcheck_*.deb' >"$scratch/apt.txt" 2>&1 ||
  { tail -20 "$scratch/apt.txt"; exit 1; }
mount -t proc proc "$root/proc"
chroot --userspec=nobody:nogroup "$root" sh -c 'cd /var/tmp && env -u HOME dexcheck run paper --out /var/tmp/paper --quiet'
ls "$root"/var/tmp/paper
