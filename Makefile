# Every target creates the environment first, so a fresh clone needs Python 3.11, git and make alone.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV   := .venv
BIN    := $(VENV)/bin
TRAIN  := $(VENV)/.installed-to-train
STAMP  := $(VENV)/.installed

.DEFAULT_GOAL := help
.PHONY: help install compare test test-browser test-cluster test-matrix attack check format build docs pages explorer-vendor benchmark clean

help:  ## list the targets
	@grep -E '^[a-z_-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 18

install: $(STAMP)  ## create .venv and install everything into it

$(TRAIN): pyproject.toml constraints.txt
	@echo "==> creating the environment in $(VENV) with $(PYTHON)"
	@test -x $(BIN)/python || "$(PYTHON)" -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt "pip>=25.1"  # knows --group
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e . --group train
	@touch $@

$(STAMP): $(TRAIN)
	@echo "==> adding what tests and checks need"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --group dev
	@touch $@

compare: $(TRAIN)  ## the main job: PPO on raw against Clarke coordinates, n = 3, 7, 11 (about 8 minutes)
	@echo "==> training raw against Clarke (configs/studies/quick.yaml); stop and start again at will, finished runs are kept"
	@$(BIN)/python train.py study --config configs/studies/quick.yaml
	@$(BIN)/python train.py report --study runs/quick

test: $(STAMP)  ## the whole test suite
	@echo "==> running the tests"
	@$(BIN)/python -m pytest -n auto --maxschedchunk 8

test-browser: $(STAMP)  ## the explorer and reports in chromium, and the explorer's JavaScript in node
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --group browser
	@for tool in chromium node; do command -v $$tool >/dev/null \
	  || { echo "$$tool is missing; on Debian: apt-get install chromium nodejs"; exit 1; }; done
	@$(BIN)/python -m pytest tests/explorer tests/agents/reporting/test_interactive.py

test-cluster: $(STAMP)  ## studies on a real Ray cluster of two nodes on this machine
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --group cluster
	@$(BIN)/python -m pytest tests/agents/studies/test_cluster.py

test-matrix: $(STAMP)  ## the wheel on every Python from 3.11 on this machine, lowest and newest dependencies
	@bash .ci/matrix

attack: $(STAMP)  ## attacks on run folders in their long form, with figures (at most 30 minutes)
	@ATTACK=long $(BIN)/python -m pytest tests/attack -n auto --dist worksteal --durations=10

check: $(STAMP)  ## ruff, mypy and the rules of imports
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

format: $(STAMP)  ## format and fix what ruff can fix
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

build: $(STAMP)  ## build the wheel, install it alone in a fresh environment, and use it there without torch
	@bash .ci/build

docs: $(STAMP)  ## build the site into docs/_build/html (about a minute); warnings are errors
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --group docs
	@$(BIN)/python -m sphinx -b html -q -E -W --keep-going docs docs/_build/html
	@$(BIN)/python -m pytest tests/site
	@echo "==> docs/_build/html/index.html"

pages: $(STAMP)  ## every page that follows from code and committed results, written again
	@$(BIN)/python -m benchmarks.pages

explorer-vendor:  ## build the explorer's libraries from npm again (they are in the checkout)
	@cd docs/explorer/vendor && npm install --no-audit --no-fund && npm run build

benchmark: $(STAMP)  ## speed, as ratios of medians inside one run
	@$(BIN)/python -m benchmarks.env_speed

clean:  ## remove caches and build output (never runs/)
	@rm -rf build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
