#!/usr/bin/env bash
# Installs the Debian 12 packages that dexcheck needs, and nothing when all are there:
#   harness/install-packages.sh              to build and run the program
#   harness/install-packages.sh archive      to make the archive and the Debian packages too (cpack)
#   harness/install-packages.sh tests        to build and run the tests and benchmarks too
#   harness/install-packages.sh development  to change it too
set -euo pipefail

packages=(
  # tools
  cmake ninja-build clang
  # the controller's side
  libeigen3-dev libtomlplusplus-dev
  # the engine; its CMake files ask for OpenGL and for qhull's headers
  libmujoco-dev libgl-dev libqhull-dev
  # robots described by URDFs, the files that an MJCF names
  liburdfdom-dev libtinyxml2-dev
  # the run's log, recordings of others
  libhdf5-dev libzip-dev liblz4-dev libzstd-dev
  # studies: databases, searches, samples (Boost.Random)
  libsqlite3-dev libsqlitecpp-dev libpagmo-dev libnlopt-dev libnlopt-cxx-dev libboost-dev
  # the command line
  libcli11-dev libfmt-dev nlohmann-json3-dev
  # off-screen drawing and video
  pkg-config libosmesa6-dev libcairo2-dev ffmpeg
  fonts-dejavu-core
  # pages: their plots, charts and replay, and the run's figures
  gnuplot-nox libjs-chart.js libjs-three
)
purpose=${1:-program}
case $purpose in
  program | archive | tests | development) ;;
  *) echo "install-packages: $purpose: must be program, archive, tests or development" >&2; exit 2 ;;
esac
if [[ $purpose == archive || $purpose == development ]]; then
  packages+=(patchelf dpkg-dev git help2man)
fi
if [[ $purpose == tests || $purpose == development ]]; then
  # tests and benchmarks, and the programs they take as oracles
  packages+=(
    libgtest-dev libgmock-dev libbenchmark-dev coinor-csdp hdf5-tools
    sqlite3 slurm-wlm munge strace xz-utils
    chromium chromium-driver python3-numpy python3-h5py doxygen
    tmux bash-completion
    # the Python module's tests
    python3-pytest
    # what is packaged: hooks, the action, figures as PDF
    pre-commit git curl poppler-utils
    # other physics engines
    libbullet-dev liborocos-kdl-dev libsimbody-dev
  )
  # Node's package manager installs MuJoCo 3; whoever has Node from elsewhere has npm with it.
  command -v npm >/dev/null || packages+=(nodejs npm)
fi
if [[ $purpose == development ]]; then
  # sanitizers and libFuzzer, coverage, static analysis
  packages+=(libclang-rt-14-dev llvm-14 clang-format-14 clang-tidy-14 cppcheck eslint)
fi

Fail() {
  echo "install-packages: $*" >&2
  exit 1
}

if ! command -v apt-get >/dev/null; then
  Fail "this is not Debian; install the equivalents of: ${packages[*]}"
fi

# Fails for packages that dpkg has never heard of, but still prints the others.
known=$(dpkg-query --show --showformat '${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null) || true
missing=()
for package in "${packages[@]}"; do
  grep -qx "$package installed" <<<"$known" || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  by_hand="run as root: apt-get install --no-install-recommends ${missing[*]}"
  command -v sudo >/dev/null || Fail "neither root nor sudo here; $by_hand"
  as_root=(sudo)
  [[ -t 0 ]] || as_root+=(--non-interactive)
  "${as_root[@]}" true || Fail "sudo refused; $by_hand"
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT

# Apt ARGUMENTS...: apt-get that asks nothing and waits for another apt to finish.
Apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 \
    apt-get --quiet=2 --option DPkg::Lock::Timeout=300 "$@" </dev/null >>"$log" 2>&1
}

echo "Installing ${missing[*]}${as_root[*]:+ (as root, with sudo)}; this takes a few minutes."
# An unreachable source need not matter: whether the packages can be had is decided by the next line.
Apt update || true
if ! Apt install --no-install-recommends "${missing[@]}"; then
  tail -n 20 "$log" >&2
  Fail "apt-get could not install the packages (they are in Debian 12's main); its last lines are above"
fi
