# Every target sets up what it needs: a virtual environment in .venv, once, until pyproject.toml changes.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --quiet --disable-pip-version-check --no-compile
COMPILE := $(BIN)/python -m compileall -qq -j 0 -x '/(tests?|torch|sympy)/' $(VENV)/lib src || true  # on all cores, where pip takes one; not what is hardly imported
USER_STAMP := $(VENV)/.installed-user
DEV_STAMP := $(VENV)/.installed-dev
DEMO_DIR := build/demo
DOCS_DIR := build/docs

.PHONY: help demo test check fuzz house docs numbers bench bench-gpu clean
.DELETE_ON_ERROR:
unexport PYTHONDONTWRITEBYTECODE  # each process that a test starts would compile the package again

help: ## show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' $(MAKEFILE_LIST) | column -t -s '|' 2>/dev/null || \
		sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1  \2/p' $(MAKEFILE_LIST)

demo: $(USER_STAMP) ## learn a wiping movement end to end and write a report to look at
	@scripts/install-system graphics || echo "make demo: going on; the arm will be drawn as lines." >&2
	@$(BIN)/unconstrain demo --out $(DEMO_DIR) --force
	@echo "The report is in $(CURDIR)/$(DEMO_DIR); open its .html file in a browser."

test: $(DEV_STAMP) ## run all tests, in parallel; COVERAGE=1 says what they leave out
	@scripts/install-system browser graphics compiler || echo "make test: going on; tests that need them will fail." >&2
	@$(BIN)/python -m pytest -n auto --maxprocesses 8 --dist worksteal $(if $(COVERAGE),--cov --cov-report=term-missing:skip-covered)

check: $(DEV_STAMP) ## lint, formatting, types, import order
	@failed=0; for tool in "ruff check ." "ruff format --check ." mypy "lint-imports --no-logo"; do \
		echo "==> $$tool"; $(BIN)/$$tool || failed=1; \
	done; exit $$failed

house: $(DEV_STAMP) ## print the plan of the rooms and its figures; HOUSE=--walk or HOUSE=--list for more
	@$(BIN)/python scripts/house.py $(HOUSE)

docs: $(DEV_STAMP) ## build the documentation; warnings are errors
	@$(BIN)/python scripts/measured.py
	@rm -rf docs/generated  # pages of names that are gone would stay
	$(BIN)/sphinx-build -W --keep-going -q -b html docs $(DOCS_DIR)
	@echo "The documentation is in $(CURDIR)/$(DOCS_DIR)/index.html"

numbers: $(DEV_STAMP) ## write the figures of README and docs from docs/results; RUNS=FOLDER takes in runs first
	@$(BIN)/python scripts/measured.py $(RUNS)

fuzz: $(DEV_STAMP) ## attack what is promised for a minute; FUZZ=--long until it is as often as docs/reliability says
	@PYTHONPATH=tests $(BIN)/python -m fuzz $(FUZZ)

bench: $(DEV_STAMP) ## time everything against floors and peers; BENCH='--full --against FILE' for more
	@$(BIN)/python benchmarks/run.py $(BENCH)

bench-gpu: $(DEV_STAMP) ## time the sums on this processor and on a GPU, if there is one
	@$(BIN)/python benchmarks/gpu.py

clean: ## remove everything built; .venv stays
	rm -rf build dist htmlcov .coverage .coverage.* docs/_build docs/auto_examples docs/generated docs/sg_execution_times.rst
	rm -rf .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find src tests examples -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "This needs Python 3.11 or newer; name one with: make PYTHON=python3.12" >&2; exit 1; }
	@echo "Creating the virtual environment $(VENV)"
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
		echo "Python could not create a virtual environment. On Debian: apt-get install python3-venv" >&2; exit 1; }
	@$(PIP) --upgrade pip || true  # one of 2023 takes 50 s longer to find which versions go together

$(USER_STAMP): pyproject.toml | $(BIN)/pip
	@echo "Installing unconstrain, its plots and the physics engine into $(VENV)"
	@$(PIP) --editable '.[viz,sim]'
	@$(COMPILE)
	@touch $@

$(DEV_STAMP): pyproject.toml | $(BIN)/pip
	@echo "Installing unconstrain and everything for its development into $(VENV); this takes a minute or two"
	@$(PIP) --editable '.[dev]'
	@$(COMPILE)
	@touch $(USER_STAMP) $@
