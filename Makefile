# Two commands: `make train` and `make test`. Each sets up what it needs, once.

PYTHON ?= python3
VENV ?= .venv
# A file of versions to keep to: make test CONSTRAINTS=constraints/ci.txt
CONSTRAINTS ?=
BIN = $(VENV)/bin
# uv installs in a fifth of the time, where it is there; `make UV= …` takes pip all the same.
UV := $(shell command -v uv)
# Every warning fails, once all are told; a reference to nothing is one.
STRICT = --fail-on-warning --keep-going --nitpicky --quiet --doctree-dir build/doctrees
CREATE = $(if $(UV),$(UV) venv --quiet --allow-existing --seed --python $(PYTHON),$(PYTHON) -m venv)
# Python compiles what it imports; to compile all that is installed is half of the installation's time. Of the rest
# a pip of before 25, as Python 3.11 and 3.12 bring it, takes a third more.
PIP = $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
INSTALL = $(if $(UV),$(UV) pip install --quiet --python $(BIN)/python,$(PIP)) $(CONSTRAINTS:%=--constraint %)

.PHONY: help train page test-page test test-ci test-all test-mujoco4 coverage lint bench docs docs-links release-check constraints clean
.DELETE_ON_ERROR:

help:
	@echo "make train     train a Q-table on MuJoCo, evaluate it, film it (ARGS=... for flags)"
	@echo "make page      build what \`mjcartpole page\` puts into a page (needs Node.js)"
	@echo "make test-page the page's own types, lint and tests, and its build, after \`make page\`"
	@echo "make test      lint, types and the fast tests"
	@echo "make test-ci   the same with the long tests: whole commands, pages, compilers"
	@echo "make test-all  every test, those of the night too"
	@echo "make test-mujoco4  what tells most, with MuJoCo 4 in an environment of its own"
	@echo "make coverage  the tests of CI, and which lines they do not reach"
	@echo "make bench     how fast it is, as ratios to gymnasium and MuJoCo alone"
	@echo "make docs      the site, into build/site (with the page at work, after \`make page\`)"
	@echo "make docs-links  the same, asking of every address whether it is there"
	@echo "make release-check  build what would be released, and try it out in fresh environments"
	@echo "make constraints  write anew which versions CI installs"
	@echo "make clean     remove the virtual environment and caches; runs and videos stay"

train: $(VENV)/installed
	@$(BIN)/mjcartpole train --backend mujoco $(ARGS)

# MuJoCo in the browser: TypeScript and npm packages become src/mjcartpole/page/assets.
page: node
	cd web && npm ci --silent
	cd web && npm run --silent build

test-page: node
	cd web && npm run --silent check && npm run --silent test && npm run --silent build

.PHONY: node
node:
	@command -v npm >/dev/null || { echo "the page needs Node.js 20 or newer, with npm" >&2; exit 1; }

test: lint
	$(BIN)/python -m pytest -q -n auto -m "not slow and not long"

test-ci: lint
	$(BIN)/python -m pytest -q -n auto -m "not slow"

test-all: lint
	$(BIN)/python -m pytest -q -n auto

# MuJoCo 4 in an environment of its own, by what tells most: bits, environments, both backends, parity.
MUJOCO4 = $(VENV)-mujoco4
test-mujoco4:
	$(PYTHON) -m venv $(MUJOCO4)
	$(MUJOCO4)/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints/mujoco4.txt \
	  --editable . pytest pytest-xdist hypothesis scipy
	$(MUJOCO4)/bin/python -m pytest -q -n auto -m "not slow" tests/test_golden.py tests/learning/test_golden_tables.py \
	  tests/physics/test_dm_control.py tests/studies/parity/test_engine_check.py tests/parity tests/envs
	$(MUJOCO4)/bin/mjcartpole parity --quick
	runs=$$(mktemp -d) && trap 'rm -rf "$$runs"' EXIT && for backend in mujoco gym; do \
	  $(MUJOCO4)/bin/mjcartpole train --backend $$backend --no-video --no-curve --run-dir "$$runs/$$backend" || exit; done

coverage: $(VENV)/installed-dev
	$(BIN)/python -m pytest -q -n auto -m "not slow" --cov --cov-report=term-missing:skip-covered $(ARGS)

bench: $(VENV)/installed-dev
	$(BIN)/python -m benchmarks.bench $(ARGS)

docs: $(VENV)/installed-docs
	$(BIN)/python -m sphinx $(STRICT) -b html docs build/site
	@echo "build/site/index.html"

docs-links: $(VENV)/installed-docs
	$(BIN)/python -m sphinx $(STRICT) -b linkcheck docs build/links

release-check:
	$(PYTHON) scripts/release_check.py

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell
	$(BIN)/mypy

$(VENV)/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "mjcartpole needs Python 3.11 or newer; try: make PYTHON=python3.11" >&2; exit 1; }
	@echo "Setting up $(VENV): the first time this takes a minute or two."
	$(CREATE) $(VENV)
	$(if $(UV),,$(PIP) 'pip>=25')
	$(INSTALL) --editable .
	@touch $@

$(VENV)/installed-dev: $(VENV)/installed
	$(INSTALL) --editable '.[dev]'
	@touch $@

$(VENV)/installed-docs: $(VENV)/installed
	$(INSTALL) --editable '.[docs]'
	@touch $@

# A fresh environment, so that nothing is pinned that nobody needs.
constraints:
	$(PYTHON) scripts/lowest_versions.py
	fresh=$$(mktemp -d) && trap 'rm -rf "$$fresh"' EXIT && $(PYTHON) -m venv "$$fresh" && \
	  freeze() { "$$fresh/bin/pip" install --quiet --disable-pip-version-check "$$2" --editable \
	    '.[dev,docs,dask,deep]' && { \
	  echo "# The versions that CI installs, on Linux with the lowest Python that is supported, with $$2."; \
	  echo "# Made by: make constraints (pip freeze --exclude-editable in a fresh environment)"; \
	  "$$fresh/bin/pip" freeze --exclude-editable; } > constraints/new.txt && \
	  mv constraints/new.txt "constraints/$$1.txt"; } && \
	  freeze ci 'mujoco<4' && freeze mujoco4 'mujoco>=4'

clean:
	rm -rf $(VENV) $(MUJOCO4) .pytest_cache .mypy_cache .ruff_cache .hypothesis .coverage build docs/generated
