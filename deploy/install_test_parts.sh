#!/usr/bin/env bash
# Installs the parts of the tests that are neither Python nor npm packages: Chromium (with a font for its pages), PostgreSQL, and
# iproute2 for the emulated networks.
# Only where that is possible without asking anybody (root on a Debian); elsewhere the tests say what is missing.
set -euo pipefail

wanted=()
for browser in chromium chromium-browser google-chrome; do
  command -v "$browser" >/dev/null 2>&1 && found=1
done
[ -n "${found:-}" ] || wanted+=(chromium fonts-dejavu-core)
ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || command -v initdb >/dev/null 2>&1 || wanted+=(postgresql)
command -v ip >/dev/null 2>&1 || wanted+=(iproute2)

[ ${#wanted[@]} -gt 0 ] || exit 0
if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
  echo "Not installed: ${wanted[*]}. The tests that need them will be skipped." >&2
  exit 0
fi
printf '\033[1m==>\033[0m %s\n' "Installing for the tests: ${wanted[*]}"
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends "${wanted[@]}" >/dev/null
