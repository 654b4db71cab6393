# Two commands: `make train` and `make test`. Each sets up what it needs, once.

PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin

.PHONY: help train test test-all lint bench clean
.DELETE_ON_ERROR:

help:
	@echo "make train     train a Q-table on MuJoCo, evaluate it, film it (ARGS=... for flags)"
	@echo "make test      lint, types and the fast tests"
	@echo "make test-all  the same with the slow tests"
	@echo "make bench     how fast it is, as ratios to gymnasium and MuJoCo alone"
	@echo "make clean     remove the virtual environment and caches; runs and videos stay"

train: $(VENV)/installed
	@$(BIN)/mjcartpole train --backend mujoco $(ARGS)

test: lint
	$(BIN)/python -m pytest -q -n auto -m "not slow"

test-all: lint
	$(BIN)/python -m pytest -q -n auto

bench: $(VENV)/installed-dev
	$(BIN)/python -m benchmarks.bench $(ARGS)

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

$(VENV)/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "mjcartpole needs Python 3.11 or newer; try: make PYTHON=python3.11" >&2; exit 1; }
	@echo "Setting up $(VENV): the first time this takes a minute or two."
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/installed-dev: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis
