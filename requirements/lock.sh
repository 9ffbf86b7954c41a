#!/usr/bin/env bash
# Resolves pyproject.toml again and writes the pinned, hashed requirement files.
# Hashes, no index lines: an address of a package index must never get into a lock file.
set -euo pipefail
cd "$(dirname "$0")/.."
lock() { uv pip compile "$@" --universal --python-version 3.11 --generate-hashes \
  --no-emit-index-url --no-emit-find-links --no-header --no-annotate --quiet; }
AGENT=deploy/packages/agent/pyproject.toml
lock pyproject.toml "$AGENT" --all-extras --output-file requirements/dev.txt
lock pyproject.toml "$AGENT" --extra build --extra sim --extra video --constraint requirements/dev.txt \
  --output-file requirements/run.txt
# What the packages for Debian and the container images contain: the tower, and the agent without and with video.
lock pyproject.toml --constraint requirements/dev.txt --output-file requirements/tower.txt
lock "$AGENT" --constraint requirements/dev.txt --output-file requirements/agent.txt
lock "$AGENT" --extra video --constraint requirements/dev.txt --output-file requirements/agent-video.txt
uv pip compile requirements/stock_clients.in --no-deps --universal --python-version 3.11 --generate-hashes \
  --no-emit-index-url --no-emit-find-links --no-header --no-annotate --quiet --output-file requirements/stock_clients.txt
