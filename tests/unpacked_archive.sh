#!/usr/bin/env bash
# The archive on systems that have nothing: unpacked in bare roots of Debian 12 and 13, as nobody and without HOME, it runs,
# draws, encodes, reports and compares; all libraries but glibc's are its own. Then its wheel, installed there by pip without a
# network: the same program, and the Python module with the NumPy of that Debian.
#   tests/unpacked_archive.sh [ARCHIVE.tar.xz]    by default what cpack makes in build/release
# Needs root, debootstrap, cpack, patchelf and poppler-utils; takes some minutes, so it is no part of the gate, but is run before
# a release.
set -euo pipefail

[[ -n ${DEXCHECK_OWN_MOUNTS:-} ]] || DEXCHECK_OWN_MOUNTS=1 exec unshare --mount "$0" "$@"
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
. "$repository/tests/bare_root.sh"
scratch=$(mktemp -d)
trap 'umount --quiet "$scratch"/*/proc || true; rm -rf --one-file-system "$scratch"' EXIT
most_bytes=60000000
Fail() {
  echo "unpacked_archive: $*" >&2
  exit 1
}

archive=${1:-}
if [[ -z $archive ]]; then
  (cd "$repository/build/release" && cpack -G TXZ -B "$scratch/packages" >"$scratch/cpack.txt" 2>&1) ||
    { tail -20 "$scratch/cpack.txt"; exit 1; }
  ! grep -A 2 Warning "$scratch/cpack.txt" || Fail "cpack warns"
  archive=$(ls "$scratch"/packages/*.tar.xz)
fi
size=$(stat --format %s "$archive")
echo "$(basename "$archive"): $size bytes"
((size < most_bytes)) || Fail "the archive has more than $most_bytes bytes"

# Nothing in it depends on where it was built, and nothing is looked for elsewhere.
mkdir "$scratch/unpacked"
tar -xf "$archive" -C "$scratch/unpacked" --strip-components=1
! grep -rlF "$repository/" "$scratch/unpacked" || Fail "the files above name $repository"
while IFS= read -r file; do
  path=$(patchelf --print-rpath "$file")
  [[ $path == "\$ORIGIN" || $path == "\$ORIGIN/"*lib/dexcheck ]] || Fail "$file: RUNPATH \"$path\""
done < <(find "$scratch/unpacked/bin" "$scratch/unpacked/lib/dexcheck" "$scratch/unpacked/libexec" -type f)
for package in ffmpeg libmujoco libosmesa6 libx264; do
  compgen -G "$scratch/unpacked/share/doc/dexcheck/licenses/$package*" >/dev/null || Fail "the licence of $package is not there"
done

wheel_folder=$scratch/wheel
mkdir "$wheel_folder"
python3 "$repository/harness/packaging/make_wheel.py" "$archive" "$wheel_folder"

# Commands of the wheel's user; $wheel is its file.
cat >"$scratch/wheel.sh" <<'COMMANDS'
set -eux
python3 -m venv --system-site-packages tools
tools/bin/pip install --no-index --no-cache-dir "$wheel"
tools/bin/dexcheck version
share=$(echo tools/lib/python3*/site-packages/dexcheck/_program/share/dexcheck)
arm=$share/harness/descriptions/examples/arm.urdf
tools/bin/dexcheck "$arm" "$arm" --quiet
tools/bin/dexcheck run paper --set duration=0.2 --out run --quiet
tools/bin/python - "$arm" <<'PYTHON'
import sys

import dexcheck
import numpy as np

robot = dexcheck.load(sys.argv[1])
assert np.linalg.eigvalsh(robot.M(np.zeros(robot.nq))).min() > 0
assert robot.compare({"M": robot.M, "g": robot.g}, samples=10)
assert not robot.compare({"M": lambda q: 1.001 * robot.M(q)}, samples=10)
assert robot.compare(sys.argv[1], samples=10)
law = lambda s: s.gravity + s.M @ (400 * (s.q_d - s.q) + 40 * (s.v_d - s.v))
assert "q" in dexcheck.run("panda-reach", law, set={"duration": 0.2}).log
PYTHON
COMMANDS

# Commands of the archive's user, nobody, in each root; $bin is the folder of the program.
cat >"$scratch/commands.sh" <<'COMMANDS'
set -eux
"$bin/dexcheck" version
"$bin/dexcheck" run paper --set duration=0.2 --out run --quiet
"$bin/dexcheck" render run --out a.mp4 --size 320x180 --quiet
"$bin/dexcheck" render run --still 0.1 --out a.png --quiet
rm -r run/figures run/report.html
"$bin/dexcheck" report run --tex run/results.tex
"$bin/dexcheck" consistency --samples 100 --quiet
share=$bin/../share/dexcheck
"$bin/dexcheck" "$share/harness/descriptions/examples/arm.urdf" "$share/harness/descriptions/examples/arm.urdf" --quiet
"$bin/dexcheck" run panda-reach --set duration=2 --out arm --quiet
"$bin/dexcheck" judge "$share/controller/parameters/panda.toml" arm
"$bin/dexcheck" init "$share/harness/descriptions/examples/arm.urdf" --out mine
"$bin/dexcheck" run mine/motion.toml --quiet
test -e "$bin/../lib/python3/dist-packages/dexcheck/__main__.py" # for controllers in Python
for file in "$bin/dexcheck" "$bin"/../libexec/dexcheck/* "$bin"/../lib/dexcheck/*; do
  LD_TRACE_LOADED_OBJECTS=1 /lib64/ld-linux-x86-64.so.2 "$file"
done >libraries.txt
COMMANDS

for suite in bookworm trixie; do
  root=$scratch/$suite
  MakeBareRoot "$root" "$suite"
  mount -t proc proc "$root/proc"
  home="/var/tmp/anywhere at all"
  mkdir "$root$home"
  mv "$scratch/commands.sh" "$root$home/"
  tar -xf "$archive" -C "$root$home" --no-same-owner
  chown -R nobody:nogroup "$root$home"
  folder=$(cd "$root$home" && ls -d dexcheck-*)
  echo "Debian $(cat "$root/etc/debian_version"), as nobody, without HOME, in $home"
  chroot --userspec=nobody:nogroup "$root" env -i PATH=/usr/bin:/bin bin="$home/$folder/bin" \
    sh -c "cd '$home' && exec sh commands.sh" >"$scratch/$suite.txt" 2>&1 || { tail -20 "$scratch/$suite.txt"; exit 1; }
  cd "$root$home"
  for picture in a.mp4 a.png run/figures/fig12a.png run/figures/fig11a.png; do
    (($(stat --format %s "$picture") > 5000)) || Fail "$picture: is almost empty"
  done
  grep -q 'Fontconfig' "$scratch/$suite.txt" && Fail "$(grep -m 1 Fontconfig "$scratch/$suite.txt")"
  (($(pdffonts run/figures/fig12a.pdf | awk 'NR > 2 && / yes +yes / && /DejaVu/' | wc -l) > 0)) || Fail "fig12a.pdf: has no DejaVu in it"
  grep -q '\\bottomrule' run/results.tex || Fail "results.tex: has no table"
  foreign=$(grep ' => ' libraries.txt | grep -v "$home/\|lib\(c\|m\|mvec\|dl\|rt\|pthread\|util\|resolv\|anl\)\.so" || true)
  [[ -z $foreign ]] || Fail "these are not the archive's own: $foreign"
  mv commands.sh "$scratch/"
  cd /
  sed -i "s/bookworm/$suite/g" "$root"/etc/apt/sources.list.d/* "$root/etc/apt/sources.list" 2>/dev/null || true
  chroot "$root" sh -c "apt-get update && apt-get install --yes --no-install-recommends python3-venv python3-numpy" \
    >"$scratch/$suite.txt" 2>&1 || { tail -20 "$scratch/$suite.txt"; exit 1; }
  install -d -o nobody -g nogroup "$root/var/tmp/wheel"
  cp "$wheel_folder"/*.whl "$scratch/wheel.sh" "$root/var/tmp/wheel/"
  wheel=$(basename "$wheel_folder"/*.whl)
  echo "$wheel with Python $(chroot "$root" python3 --version | cut -d ' ' -f 2)"
  # Without a network of its own, as nobody, without HOME.
  unshare --net chroot --userspec=nobody:nogroup "$root" env -i PATH=/usr/bin:/bin wheel="./$wheel" \
    sh -c "cd /var/tmp/wheel && exec sh wheel.sh" >"$scratch/$suite.txt" 2>&1 || { tail -20 "$scratch/$suite.txt"; exit 1; }
done
echo "the archive and its wheel run on both"
