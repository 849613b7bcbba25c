# The lab's commands. Each sets up .venv first where that is needed; a repeat costs nothing.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready
BENCH := .venv-bench
MUTANTS := .venv-mutants

.DEFAULT_GOAL := help
.PHONY: help book student test lab bench mutants clean

help: ## list these commands
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

book: $(READY) ## run every notebook and build the book
	@$(BIN)/python book/_ext/browser_files.py
	$(BIN)/jupyter-book build . --all -W -n --keep-going
	@echo "Open $(CURDIR)/_build/html/index.html in a browser."

student: $(READY) ## write what students get: the lab and its book without solutions
	@$(BIN)/python book/_ext/browser_files.py
	$(BIN)/python book/_ext/students_edition.py

test: $(READY) ## check style and types, then test code, notebooks and pages
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest tests labkit $(wildcard notebooks/*.ipynb) \
	    --nbval-lax --nbval-current-env --numprocesses 2 --dist loadfile

lab: $(READY) ## open the notebooks in JupyterLab
	$(BIN)/jupyter lab notebooks

bench: ## time the lab's matcher beside others and write the book's page on it (half an hour)
	@test -x $(BENCH)/bin/python || $(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip install --quiet --disable-pip-version-check \
	    --requirement tests/bench/requirements.txt --editable .
	$(BENCH)/bin/python tests/bench/run.py --out $(BENCH)/results.json $(BENCH_OPTIONS)
	$(BENCH)/bin/python tests/bench/report.py $(BENCH)/results.json
	@echo "The page is book/benchmark.md; make book shows it."

mutants: ## change the core in some two thousand places, and list what its tests do not notice (an hour)
	@test -x $(MUTANTS)/bin/python || $(PYTHON) -m venv $(MUTANTS)
	$(MUTANTS)/bin/python -m pip install --quiet --disable-pip-version-check \
	    --constraint requirements.txt mutmut==3.8.1 pytest hypothesis --editable .
	PATH=$(CURDIR)/$(MUTANTS)/bin:$$PATH mutmut run --max-children 2
	$(MUTANTS)/bin/mutmut results

clean: ## remove all that these commands made, .venv included
	rm -rf $(VENV) .venv-wolfram .venv-graders .venv-numpy1 $(BENCH) $(MUTANTS) mutants _build build book/_static/vendor *.egg-info
	rm -rf .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -prune -exec rm -rf {} +

$(READY): requirements.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "The lab needs Python 3.11 or newer as '$(PYTHON)'."; \
	    echo "Name another one like this: make PYTHON=python3.12 ..."; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	    echo "'$(PYTHON)' cannot make environments."; \
	    echo "On Debian and Ubuntu: sudo apt install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --requirement requirements.txt --editable .
	$(BIN)/python -c 'import matplotlib.font_manager'  # finds the fonts, once
	$(BIN)/python -c 'from labkit.engine import warm; warm()'  # compiles the engine, once
	@touch $@
