# The commands people and scripts rely on. `make` alone prints what there is.
.DEFAULT_GOAL := help
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:

# Python keeps what it has compiled, also where the environment says not to: the workers, and each program that they
# start, would compile the same sources.
unexport PYTHONDONTWRITEBYTECODE

PYTHON ?= python3
BIN := .venv/bin
TEST_WORKERS ?= 4
SAY := printf '\033[1m==>\033[0m %s\n'
# mkdocs-material announces its successor at every run.
MKDOCS := NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs
PIP := $(BIN)/python -m pip --disable-pip-version-check -qq

RUN_READY := .venv/.ready-to-run
DEV_READY := .venv/.ready-to-develop
WEB_READY := web/node_modules/.ready
PROJECTS := pyproject.toml deploy/packages/agent/pyproject.toml
CONSOLE := web/dist/index.html
WEB_SOURCES := $(shell find web -type f -not -path '*/node_modules/*' -not -path 'web/dist/*' 2>/dev/null)

.PHONY: help
help: ## print this
	@printf 'Control Tower\n\n'
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))
	@printf '\nSettings are environment variables: see docs/settings.md.\n'

.PHONY: run
run: $(RUN_READY) $(CONSOLE) ## build what is missing, then start the tower with a simulated squad
	@$(BIN)/python deploy/run_local.py

.PHONY: setup
setup: $(DEV_READY) $(WEB_READY) $(CONSOLE) ## install everything into .venv and web/, start nothing

.PHONY: check check-python check-console check-generated check-docs
check: check-python check-console check-generated check-docs ## format, lint, types, import rules, links of documents

check-python: $(DEV_READY)
	@$(SAY) "Python: format, lint, types, import rules, structure"
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/mypy
	@MYPYPATH=tests $(BIN)/mypy --explicit-package-bases tests/real  # CI has no autopilot to run them
	@$(BIN)/lint-imports
	@$(BIN)/python deploy/check_structure.py
	@$(BIN)/python deploy/check_autopilots.py
	@$(BIN)/python tests/check_costs.py
	@$(BIN)/python -m bench.worst.cases

check-console: $(WEB_READY)
	@$(SAY) "Console: format, lint, types"
	@cd web && npm run --silent check

check-generated: $(DEV_READY) $(WEB_READY)
	@$(SAY) "Generated files: the console's REST types, autopilots and the tower's texts"
	@$(BIN)/python web/scripts/generate_autopilots.py --check
	@$(BIN)/python web/scripts/tower_texts.py --check
	@cd web && PYTHON=$(CURDIR)/$(BIN)/python npm run --silent generate:check

check-docs: $(DEV_READY)
	@$(SAY) "Documentation: every link and anchor"
	@$(MKDOCS) build --quiet --site-dir $(CURDIR)/.venv/site

.PHONY: docs
docs: $(DEV_READY) ## build the documentation site into site/
	@$(MKDOCS) build --quiet
	@$(SAY) "Open site/index.html"

.PHONY: generate
generate: $(DEV_READY) $(WEB_READY) ## write the files that are made from the dialect, the profiles and the OpenAPI document
	@$(BIN)/python web/scripts/generate_mavlink.py
	@$(BIN)/python web/scripts/generate_autopilots.py
	@$(BIN)/python web/scripts/tower_texts.py
	@cd web && PYTHON=$(CURDIR)/$(BIN)/python npm run --silent generate

.PHONY: test test-long
test: TIER =
test: ## run the tests that protect flight, access, data and pages; TEST_WORKERS=4 at a time
test-long: TIER = --long
test-long: ## run every test, with more examples: before a release
# Tests are compiled here once, which each worker would do for itself.
test test-long: setup
	@PYTHON=$(BIN)/python deploy/install_test_parts.sh & parts=$$!; \
	$(BIN)/python -m pytest --collect-only -qq >/dev/null & compiling=$$!; \
	trap 'kill $$parts $$compiling 2>/dev/null || true' EXIT; \
	$(SAY) "Console: unit tests"; \
	(cd web && TEST_TIER=$(TIER) npm test --silent); \
	wait $$parts; \
	wait $$compiling || true
	@$(SAY) "Unit, integration and browser tests"
	@TEST_WORKERS=$(TEST_WORKERS) $(BIN)/python tests/run_all.py $(TIER)

.PHONY: release
release: setup ## build wheels, packages for Debian, checksums and bills of materials into dist/
	@$(SAY) "Building the release into dist/"
	@$(BIN)/python deploy/release.py

.PHONY: audit
audit: $(DEV_READY) ## ask the public lists of known weaknesses about every pinned package
	@$(SAY) "Known weaknesses of packages"
	@$(BIN)/python deploy/audit.py

.PHONY: format
format: $(DEV_READY) $(WEB_READY) ## put every file into the house format
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .
	@cd web && npm run --silent format

.PHONY: lock
lock: ## resolve the requirements again and write the pinned, hashed files (needs uv)
	@requirements/lock.sh

.PHONY: clean
clean: ## remove what was built and installed; data in var/ stays
	rm -rf .venv web/node_modules web/dist

.venv/bin/python:
	@$(SAY) "Making a virtual environment in .venv"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "Control Tower needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) -V)." >&2; exit 1; }
	@$(PYTHON) -m venv .venv

$(RUN_READY): requirements/run.txt $(PROJECTS) | .venv/bin/python
	@$(SAY) "Installing Python packages (about a minute, once)"
	@$(PIP) install --require-hashes -r requirements/run.txt
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@$(PIP) install --no-deps --no-build-isolation --editable deploy/packages/agent
	@touch $@

$(DEV_READY): requirements/dev.txt $(PROJECTS) | .venv/bin/python
	@$(SAY) "Installing Python packages for development (about a minute, once)"
	@$(PIP) install --require-hashes -r requirements/dev.txt
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@$(PIP) install --no-deps --no-build-isolation --editable deploy/packages/agent
	@touch $@ $(RUN_READY)

$(WEB_READY): web/package-lock.json
	@$(SAY) "Installing the console's packages (once)"
	@node -e 'process.exit(parseInt(process.versions.node) < 20 ? 1 : 0)' \
	  || { echo "Control Tower needs Node 20 or newer; this is $$(node -v)." >&2; exit 1; }
	@cd web && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

$(CONSOLE): $(WEB_READY) $(WEB_SOURCES)
	@$(SAY) "Building the console"
	@cd web && npm run --silent build
	@touch $@
