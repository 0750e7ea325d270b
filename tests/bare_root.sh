# MakeBareRoot FOLDER [SUITE]: a bare Debian (debootstrap's minbase), bookworm unless another is named, whose packages come
# from where this machine's come from; what apt installs later is bookworm's.
# Sourced by scripts that run as root; they umount what they mounted, or have a mount namespace of their own.
MakeBareRoot() {
  local root=$1 suite=${2:-bookworm} log
  log=$(mktemp)
  debootstrap --variant=minbase "$suite" "$root" ${DEBIAN_MIRROR:+"$DEBIAN_MIRROR"} >"$log" ||
    { tail -20 "$log"; return 1; }
  rm "$log"
  cp /etc/resolv.conf "$root/etc/"
  rm -f "$root/etc/apt/sources.list"
  cp -rL /etc/apt/. "$root/etc/apt/"
}
