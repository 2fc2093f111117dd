#!/bin/bash
# Builds the .deb with cargo-deb, installs it in an empty container of the same Debian, and runs the
# program there as an ordinary user. As root; needs cargo-deb (cargo install cargo-deb), dpkg-dev,
# debootstrap and the network.
# usage: jobs/packaging/deb.sh [FOLDER]      (default: target/deb; removed at the end but for the .deb)
#   DEB_FLAGS=--no-build        packs the target/release that is there
#   MIRROR=http://...           where debootstrap takes Debian from
set -eu
cd "$(dirname "$0")/../.."
place=$(realpath -m "${1:-target/deb}")
mirror=${MIRROR:-http://deb.debian.org/debian}
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
mkdir -p "$place"
rm -f "$place"/*.deb
cargo deb --strip ${DEB_FLAGS:-} --output "$place"
package=$(ls "$place"/*.deb)
dpkg-deb --info "$package" | sed -n '/Depends/p;/Installed-Size/p;/Description/p'

root=$place/root
rm -rf --one-file-system "$root"
debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$place/debootstrap.log"
cp "$package" "$root/mpm-par.deb"
cat >"$root/try.sh" <<'SCRIPT'
set -eu
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t tmpfs tmpfs /dev/shm
apt-get update -q >/dev/null
DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends ./mpm-par.deb >apt.log
useradd --create-home user
su user -s /bin/bash -c 'set -euo pipefail; cd
  mpm-par --version
  mpm-par --new slope >/dev/null
  mpm-par slope.toml --check >/dev/null
  mpirun --oversubscribe -n 2 mpm-par slope.toml --set analysis.steps=2 | tail -n 3
  mpirun --oversubscribe -n 2 mpm-par /usr/share/doc/mpm-par/inputs/beam.toml --out out/beam | tail -n 3
  mpm-par report out/slope'
apt-get remove -y -q mpm-par >/dev/null
! command -v mpm-par
SCRIPT
# Mounts of its own, which end with the script. It starts in the folder that chroot makes the top one.
mkdir -p "$root/dev/shm"
unshare --mount --fork chroot "$root" /usr/bin/env -i HOME=/ \
  PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin bash try.sh
rm -rf --one-file-system "$root"
echo "deb: $package was installed, run and removed"
