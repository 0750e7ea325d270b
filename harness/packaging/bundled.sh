#!/usr/bin/env bash
# Builds, from Debian 12's sources, the two libraries and programs of others that would make the archive too large as Debian
# has them: Mesa's off-screen rasteriser with the part of LLVM that it calls (14 MB instead of 42), and ffmpeg with the
# encoder that is used alone (1 MB instead of 52). As root on Debian 12, since it installs what they are built with:
#   harness/packaging/bundled.sh PREFIX        then cmake -DDEXCHECK_BUNDLED=PREFIX
set -euo pipefail

[[ $# -eq 1 && $(id -u) -eq 0 ]] || { echo "bundled: as root: bundled.sh PREFIX" >&2; exit 2; }
mkdir -p "$1"
prefix=$(realpath "$1")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch" /etc/apt/sources.list.d/dexcheck-sources.sources' EXIT
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8

cat >/etc/apt/sources.list.d/dexcheck-sources.sources <<SOURCES
Types: deb-src
URIs: ${DEBIAN_MIRROR:-http://deb.debian.org/debian}
Suites: bookworm
Components: main
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg
SOURCES
apt-get --quiet=2 update
apt-get --quiet=2 --yes install --no-install-recommends ca-certificates dpkg-dev gcc g++ make meson ninja-build pkg-config nasm \
  python3-mako bison flex llvm-15-dev zlib1g-dev libexpat1-dev libx264-dev >"$scratch/apt.log" 2>&1 ||
  { tail -20 "$scratch/apt.log"; exit 1; }
cd "$scratch"
apt-get --quiet=2 source mesa ffmpeg >source.log 2>&1 || { tail -20 source.log; exit 1; }

(
  cd mesa-*/
  # Mesa's own LLVM (llvm-config-15) in static libraries: of its targets only this machine's is linked.
  # llvm-config names Polly's libraries, too, which Debian's LLVM 15 does not have and nothing here calls.
  mkdir "$scratch/empty"
  ar rcs "$scratch/empty/libPolly.a"
  ar rcs "$scratch/empty/libPollyISL.a"
  printf "[binaries]\nllvm-config = '/usr/bin/llvm-config-15'\n" >native.ini
  meson setup build --native-file native.ini --buildtype=release --strip --prefix="$prefix" --libdir=lib \
    -Dosmesa=true -Dgallium-drivers=swrast -Dvulkan-drivers= -Dplatforms= -Dglx=disabled -Degl=disabled -Dgbm=disabled \
    -Dgles1=disabled -Dgles2=disabled -Dshared-glapi=disabled -Dllvm=enabled -Dshared-llvm=disabled -Dzstd=disabled \
    -Dshader-cache=disabled -Dlibunwind=disabled -Dvalgrind=disabled -Dbuild-tests=false \
    -Db_ndebug=true -Dcpp_link_args="-L$scratch/empty" >meson.log || { tail -20 meson.log; exit 1; }
  ninja -C build install >ninja.log || { tail -20 ninja.log; exit 1; }
  install -Dm644 debian/copyright "$prefix/share/doc/libosmesa6/copyright"
)
(
  cd ffmpeg-*/
  ./configure --prefix="$prefix" --disable-everything --disable-autodetect --disable-doc --disable-network --disable-debug \
    --disable-ffplay --disable-ffprobe --enable-gpl --enable-libx264 --enable-decoder=rawvideo \
    --enable-demuxer=rawvideo --enable-protocol=pipe,file --enable-encoder=libx264 \
    --enable-muxer=mp4 --enable-filter=scale >configure.log ||
    { tail -20 configure.log; exit 1; }
  make --jobs="$(nproc)" ffmpeg >make.log 2>&1 || { tail -20 make.log; exit 1; }
  install -Dsm755 ffmpeg "$prefix/bin/ffmpeg"
  install -Dm644 debian/copyright "$prefix/share/doc/ffmpeg/copyright"
)
