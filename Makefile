# Every target sets up what it needs: a machine with Python 3.11+, git and make is enough.
# Nothing is installed outside .venv, build and dist.

PYTHON ?= python3
# Extra arguments for the tool that a target runs, for example: make test ARGS="-k braid -n 0"
ARGS ?=

VENV := .venv
PY := $(VENV)/bin/python
# uv as a module: it needs no script whose first line would break when the folder is moved.
UV := $(PY) -m uv
# pytest needs no more than two workers, and a file's tests share compiled kernels within one worker.
# In the order of the folders: the few long tests of integration/ begin, or one worker ends with them.
PYTEST := -m pytest -n 2 --dist loadfile --no-loadscope-reorder
# Before them one process compiles the kernel and the check of its steps, or both workers would. If
# that fails, the tests show why.
COMPILE := -m pamsim step --pressure 100,0 --duration 100ms > /dev/null

# A slow mirror is no reason to fail, and the Python given above is the one to use.
export UV_HTTP_TIMEOUT ?= 180
export UV_PYTHON_DOWNLOADS ?= never
# The package cache may lie on another disk, where the default (hard links) only warns and copies.
export UV_LINK_MODE ?= copy
export PIP_DISABLE_PIP_VERSION_CHECK ?= 1

# Without the modules' bytecode every worker and every command that a test starts compiles all imports.
unexport PYTHONDONTWRITEBYTECODE

MAKEFLAGS += --no-builtin-rules --no-print-directory
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
# Targets share one environment and one machine: two at a time would only get in each other's way.
.NOTPARALLEL:
.PHONY: help reproduce test test-slow lint format lock test-lowest docs wheel benchmark clean

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' Makefile

reproduce: $(VENV)/.run-stamp ## the main job: every printed experiment, tables, figures and page in out/reproduce
	@mkdir -p out/reproduce
	$(VENV)/bin/pamsim reproduce --force --out out/reproduce --json out/reproduce/reproduce.json $(ARGS)

test: $(VENV)/.dev-stamp ## run the test suite (ARGS="..." goes to pytest)
	-@PAMSIM_CHECK=1 $(PY) $(COMPILE)
	$(PY) $(PYTEST) $(ARGS)

test-slow: $(VENV)/.dev-stamp ## what `make test` leaves out: studies, the GPU's code on the CPU, a window
	$(PY) $(PYTEST) -m slow $(ARGS)

lint: $(VENV)/.dev-stamp ## style, formatting, types, import directions, spelling, plain words
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m basedpyright
	$(VENV)/bin/lint-imports
	$(PY) -m codespell_lib
	$(PY) scripts/lint_words.py

format: $(VENV)/.dev-stamp ## let ruff format the code and mend what it can
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

# Every warning is an error: a link without a target, a page that no list names, a notebook that fails.
SITE := build/docs/html

docs: $(VENV)/.docs-stamp ## the site of the documentation (ARGS="-b linkcheck" asks other sites too)
	$(PY) -m sphinx -E -a -W --keep-going -q -c docs -d build/docs/doctrees $(ARGS) . $(SITE)
	@echo "$(SITE)/index.html"

# --- environment -------------------------------------------------------------------------------

# Order-only below: the time stamp of an interpreter does not show what is installed beside it.
$(PY):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "pamsim needs Python 3.11 or newer, and '$(PYTHON)' is not: name one with 'make PYTHON=/path/to/python3 ...'" >&2; exit 1; }
	@echo "setting up $(VENV) (first time only)"
	@$(PYTHON) -m venv $(VENV)

# uv installs the lock in seconds where pip takes minutes. Its own version and hashes come from the
# lock as well. Without it, pip installs the same files, slower.
$(VENV)/.uv-stamp: requirements.lock | $(PY)
	@awk '/^[^ #]/ { keep = /^uv==/ } keep' requirements.lock > $(VENV)/uv.txt
	@$(PY) -m pip install -q --require-hashes --no-deps -r $(VENV)/uv.txt \
	  || echo "uv cannot be had here; pip does its work, more slowly"
	@touch $@

# $(call install,ARGUMENTS): by uv; by pip where uv is missing or cannot reach the index that pip can.
define install
	@{ $(UV) --version >/dev/null 2>&1 && $(UV) pip install -q --python $(PY) $(1); } \
	  || { echo "installing with pip"; $(PY) -m pip install -q $(1); }
endef

$(VENV)/.run-stamp: requirements.lock pyproject.toml $(VENV)/.uv-stamp
	$(call install,--require-hashes -r requirements.lock)
	$(call install,--no-deps --no-build-isolation -e .)
	@touch $@

$(VENV)/.dev-stamp: requirements-dev.lock $(VENV)/.run-stamp
	$(call install,--require-hashes -r requirements-dev.lock)
	@touch $@

$(VENV)/.docs-stamp: requirements-docs.lock $(VENV)/.run-stamp
	$(call install,--require-hashes -r requirements-docs.lock)
	@touch $@

# --- releases ----------------------------------------------------------------------------------

# One version of each package for all Pythons and systems (--universal, --fork-strategy fewest), so
# that two people who compare results compare the same numpy. Pins stay unless UPGRADE=1.
LOCK := pip compile pyproject.toml --quiet --universal --python-version 3.11 --fork-strategy fewest \
  --generate-hashes --no-emit-index-url --no-emit-find-links --annotation-style line \
  --custom-compile-command "make lock" $(if $(UPGRADE),--upgrade)

lock: | $(PY) ## resolve pyproject.toml into the lock files (UPGRADE=1: newest versions)
	@$(UV) --version >/dev/null 2>&1 || $(PY) -m pip install -q uv
	$(UV) $(LOCK) --group build --output-file requirements.lock
	$(UV) $(LOCK) --group dev --constraints requirements.lock --output-file requirements-dev.lock
	$(UV) $(LOCK) --group docs --constraints requirements.lock --constraints requirements-dev.lock --output-file requirements-docs.lock
	$(UV) $(LOCK) --group dev --resolution lowest-direct --output-file requirements-lowest.lock

# Every lower bound in pyproject.toml is a promise, so it is tested: the oldest version of each
# package that is allowed. What these ask for themselves is the newest that they take.
LOWEST := build/lowest

$(LOWEST)/.stamp: pyproject.toml requirements-lowest.lock $(VENV)/.uv-stamp
	@rm -rf $(LOWEST) && mkdir -p build && $(PYTHON) -m venv $(LOWEST)
	$(UV) pip install -q --python $(LOWEST)/bin/python --require-hashes -r requirements-lowest.lock
	$(UV) pip install -q --python $(LOWEST)/bin/python --no-deps --no-build-isolation -e .
	@touch $@

test-lowest: $(LOWEST)/.stamp ## the test suite with the oldest version of every package that is allowed
	@$(LOWEST)/bin/python -c 'import mujoco, numpy; print("mujoco", mujoco.__version__, "numpy", numpy.__version__)'
	-@PAMSIM_CHECK=1 $(LOWEST)/bin/python $(COMPILE)
	$(LOWEST)/bin/python $(PYTEST) $(ARGS)

# Installed outside the repository, so that nothing is found by accident because it lies beside.
SMOKE := import pathlib, pamsim; \
  home = pathlib.Path(pamsim.__file__).parent; \
  have = sorted(p.parent.name for p in home.glob("_models/*/params.toml")); \
  assert have, f"no rig in {home}/_models"; \
  print("wheel is whole; rigs inside:", *have)

wheel: $(VENV)/.run-stamp ## build the wheel in dist, install it elsewhere, try it
	@rm -f dist/*.whl
	$(PY) -m hatchling build -t wheel -d dist
	@set -e; elsewhere=$$(mktemp -d); trap 'rm -rf "$$elsewhere"' EXIT; \
	  $(PYTHON) -m venv "$$elsewhere/venv"; \
	  py="$$elsewhere/venv/bin/python"; \
	  if $(UV) --version >/dev/null 2>&1; then pip="$(UV) pip install --python $$py"; else pip="$$py -m pip install"; fi; \
	  $$pip -q --require-hashes -r requirements.lock; \
	  $$pip -q --no-deps dist/*.whl; \
	  cd "$$elsewhere"; \
	  venv/bin/pamsim --help; \
	  venv/bin/python -I -c '$(SMOKE)'

benchmark: $(VENV)/.run-stamp ## run every script in scripts/benchmarks
	@set -e; for script in $$(grep -l __main__ scripts/benchmarks/*.py); do \
	  echo "== $$script"; $(PY) "$$script" $(ARGS); done

clean: ## remove what the targets made, except .venv
	rm -rf build dist out/reproduce .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find pamsim tests scripts -name __pycache__ -type d -prune -exec rm -rf {} +
