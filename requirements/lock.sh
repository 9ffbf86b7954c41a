#!/usr/bin/env bash
# Resolves pyproject.toml again and writes the pinned, hashed requirement files.
# Hashes, no index lines: an address of a package index must never get into a lock file.
set -euo pipefail
cd "$(dirname "$0")/.."
lock() { uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
  --no-emit-index-url --no-emit-find-links --no-header --no-annotate --quiet "$@"; }
lock --extra build --extra dev --extra docs --output-file requirements/dev.txt
lock --extra build --constraint requirements/dev.txt --output-file requirements/run.txt
uv pip compile requirements/stock_clients.in --no-deps --universal --python-version 3.11 --generate-hashes \
  --no-emit-index-url --no-emit-find-links --no-header --no-annotate --quiet --output-file requirements/stock_clients.txt
