#!/usr/bin/env bash
# Installs the parts of the tests that are not Python or npm packages: Chromium, and fonts for its screenshots.
# Only where that is possible without asking anybody (root on a Debian); elsewhere the tests say what is missing.
set -euo pipefail

have_browser() { command -v chromium || command -v chromium-browser || command -v google-chrome; } >/dev/null 2>&1

if have_browser; then exit 0; fi
if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
  echo "Chromium is not installed: the browser tests will be skipped (Debian: apt-get install chromium)." >&2
  exit 0
fi
printf '\033[1m==>\033[0m %s\n' "Installing Chromium for the browser tests"
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core >/dev/null
