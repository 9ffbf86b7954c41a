#!/usr/bin/env bash
# Installs the parts of the tests that are not packages of this project: other people's ground stations and Caddy (beside
# the packages of the virtual environment, not among them), Chromium (with a font for its pages), PostgreSQL, FFmpeg's
# programs (they judge our recordings), iproute2 for the emulated networks, promtool for the alert rules, and NATS. All but
# the first only where that is possible without asking anybody (root on a Debian); elsewhere the tests say what is missing.
set -euo pipefail

cd "$(dirname "$0")/.."
prefix="$("${PYTHON:-python3}" -c 'import sys; print(sys.prefix)')"
clients="$prefix/stock-clients"
if ! cmp -s requirements/stock_clients.txt "$clients/installed.txt"; then
  printf '\033[1m==>\033[0m %s\n' "Installing MAVProxy and MAVSDK for the tests (about a minute, once)"
  rm -rf "$clients"
  if "${PYTHON:-python3}" -m pip --disable-pip-version-check -qq install --no-deps --require-hashes --target "$clients" \
    -r requirements/stock_clients.txt; then
    cp requirements/stock_clients.txt "$clients/installed.txt"
  else
    echo "Not installed: MAVProxy and MAVSDK. The tests that need them will be skipped." >&2
  fi
fi

wanted=()
for browser in chromium chromium-browser google-chrome; do
  command -v "$browser" >/dev/null 2>&1 && found=1
done
[ -n "${found:-}" ] || wanted+=(chromium fonts-dejavu-core)
# Shows the same pages with half of the processor time. Not every distribution has it.
shell=()
command -v chromium-headless-shell >/dev/null 2>&1 || shell+=(chromium-headless-shell)
ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || command -v initdb >/dev/null 2>&1 || wanted+=(postgresql)
command -v ffprobe >/dev/null 2>&1 || wanted+=(ffmpeg)
command -v ip >/dev/null 2>&1 || wanted+=(iproute2)
command -v promtool >/dev/null 2>&1 || wanted+=(prometheus)
# These programs alone: the packages would start servers on this machine.
programs=()
command -v caddy >/dev/null 2>&1 || [ -x "$prefix/programs/usr/bin/caddy" ] || programs+=(caddy)
PATH="$PATH:/usr/sbin" command -v nats-server >/dev/null 2>&1 || [ -x "$prefix/programs/usr/sbin/nats-server" ] ||
  programs+=(nats-server)

[ $((${#wanted[@]} + ${#shell[@]} + ${#programs[@]})) -gt 0 ] || exit 0
if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
  echo "Not installed: ${wanted[*]} ${shell[*]} ${programs[*]}. The tests that need them will be skipped." >&2
  exit 0
fi
printf '\033[1m==>\033[0m %s\n' "Installing for the tests: ${wanted[*]} ${shell[*]} ${programs[*]}"
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
[ ${#wanted[@]} -eq 0 ] || apt-get install -y -qq --no-install-recommends "${wanted[@]}" >/dev/null
[ ${#shell[@]} -eq 0 ] || apt-get install -y -qq --no-install-recommends "${shell[@]}" >/dev/null ||
  echo "Not installed: ${shell[*]}. The browser tests take longer with the whole Chromium." >&2
for one in "${programs[@]}"; do
  packages="$(mktemp -d)"
  (cd "$packages" && apt-get download -qq "$one" >/dev/null && dpkg-deb --extract "$one"_*.deb "$prefix/programs")
  rm -rf "$packages"
done
