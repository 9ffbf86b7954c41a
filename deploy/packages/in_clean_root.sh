#!/usr/bin/env bash
# Installs a package in a root without anything of ours, runs its program there, and removes it again. Needs root and
# Linux; touches nothing outside the folder that it is given. The root is this system's /usr below an overlay, with
# /etc, /opt, /var and the list of packages empty. Dependencies are not installed (they are in /usr): dpkg is told so.
#
#   in_clean_root.sh FOLDER PACKAGE.deb PROGRAM
set -euo pipefail
if [ -z "${IN_CLEAN_ROOT:-}" ]; then
  IN_CLEAN_ROOT=1 exec unshare --mount --pid --fork --kill-child "$0" "$@"
fi
root=$1 deb=$2 program=$3
mkdir -p "$root"
mount -t tmpfs -o mode=0755 clean-root "$root"
mkdir -p "$root"/{usr,etc,opt,var/lib/dpkg/info,var/lib/dpkg/updates,var/log,tmp,proc,dev,run,root,.upper,.work}
mount -t overlay -o "lowerdir=/usr,upperdir=$root/.upper,workdir=$root/.work" overlay "$root/usr"
for one in bin sbin lib lib32 lib64; do
  [ -L "/$one" ] && ln -s "usr/$one" "$root/$one"
done
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
cp /etc/passwd /etc/group /etc/ld.so.cache /etc/ld.so.conf "$root/etc/"
touch "$root/var/lib/dpkg/status" "$root/var/lib/dpkg/available"
cp "$deb" "$root/tmp/package.deb"

inside() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 TOWER_VAR=/var/lib/control-tower \
  chroot "$root" "$@"; }
name=$(dpkg-deb --field "$deb" Package)
inside dpkg --force-depends --install /tmp/package.deb
echo "installed $(inside dpkg-query --show --showformat '${Version}' "$name")"
echo "version $(inside "/usr/bin/$program" --version)"
[ "$program" != tower ] || inside /usr/bin/tower migrate --first-admin
inside dpkg --verify "$name"
inside dpkg --force-depends --purge "$name"
echo "left behind: $(cd "$root" && find opt etc/control-tower etc/tower-agent usr/bin/"$program" usr/lib/systemd/system/tower*.service \
  -mindepth 1 2>/dev/null | head -5 | grep . || echo nothing)"
