# The lab's commands. Each sets up .venv first where that is needed; a repeat costs nothing.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/ready
TESTS := $(VENV)/ready-to-test
PIP = $(BIN)/python -B -m pip install --quiet --disable-pip-version-check --no-compile
GET_UV = $(PIP) uv==0.13.9  # six times as fast as pip, which knows more mirrors
PINS := $(firstword $(wildcard requirements-dev.txt) requirements.txt)  # students have the latter
AUTHORS := $(if $(wildcard requirements-dev.txt),--group authors)
PIP_SAYS = $(shell $(BIN)/python -m pip config get global.$(1) 2>/dev/null)
INDEX = $(or $(UV_DEFAULT_INDEX),$(PIP_INDEX_URL),$(call PIP_SAYS,index-url))
CERTIFICATES = $(or $(SSL_CERT_FILE),$(PIP_CERT),$(call PIP_SAYS,cert))
UV = UV_SYSTEM_CERTS=1 $(INDEX:%=UV_DEFAULT_INDEX='%') $(CERTIFICATES:%=SSL_CERT_FILE='%') \
    $(BIN)/uv pip install --quiet --python $(BIN)/python --constraint $(PINS)
COMPILE = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
    --no-strip-extras --no-header pyproject.toml --group build
EXTRAS := book grading report ros
COMMA := ,
NOTEBOOKS := $(wildcard notebooks/*.ipynb)
# Newer than the notebooks and the code with which they ran.
RAN := _build/ran
NBVAL := $(BIN)/pytest -q -p tests.tools.patient_nbval --nbval-lax --nbval-current-env
BENCH := .venv-bench
LAB_SETTINGS := $(VENV)/share/jupyter/lab/settings
WARM = $(BIN)/python -m labkit.support.warm  # compiles the stages where they are new

unexport PYTHONDONTWRITEBYTECODE  # or each process compiles each module that it imports
# The notebooks and tests beside each other take all processors.
export OPENBLAS_NUM_THREADS ?= 1

.DEFAULT_GOAL := help
.PHONY: help book student test pages others quick fix lab bench mutants lock dist clean

help: ## list these commands
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

book: $(READY) ## run every notebook and build the book
	@mkdir -p _build && touch _build/began
	$(BIN)/jupyter-book build . --all -W -n --keep-going
	@mv _build/began $(RAN)
	@echo "Open $(CURDIR)/_build/html/index.html in a browser."

student: $(READY) ## write what students get: the lab and its book without solutions
	$(BIN)/python book/_ext/students_edition.py

test: $(TESTS) ## check style and types, then test code, widgets and what is new in notebooks
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@$(WARM)
	@$(MAKE) --no-print-directory $(RAN)
	@$(BIN)/mypy > _build/types 2>&1 & types=$$!; \
	    $(BIN)/pytest tests labkit -m "not others and not pages and not nightly" \
	        --numprocesses 3 --dist loadfile --no-loadscope-reorder; tests=$$?; \
	    wait $$types && exit $$tests || { cat _build/types; exit 1; }

pages: $(TESTS) ## open each page of the book, which `make book` built, in a browser
	@test -d _build/html || { echo "There is no book yet: make book"; exit 1; }
	BOOK_HTML=_build/html $(BIN)/pytest tests/book -m pages --numprocesses 2

others: $(TESTS) ## test the ports in their languages, the pages in Firefox, the exports in other graders
	@test -d _build/html || { echo "There is no book yet: make book"; exit 1; }
	BOOK_HTML=_build/html $(BIN)/pytest tests -m others --numprocesses 2 --dist loadfile

quick: $(TESTS) ## the tests of the core, logs and odometry, with few examples: a minute
	$(BIN)/ruff check .
	LABKIT_EXAMPLES=quick $(BIN)/pytest -q -m "not slow and not nightly" --numprocesses 2 --dist loadfile \
	    $(wildcard tests/test_*.py) tests/odometry tests/logs tests/simulation tests/evaluation

fix: $(TESTS) ## format the code and mend what ruff can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/mypy

lab: $(READY) ## open the notebooks in JupyterLab
	$(BIN)/jupyter lab --ServerApp.root_dir=. --LabApp.default_url=/lab/tree/notebooks

bench: ## time the lab's matcher beside others and write the book's page on it (half an hour)
	@test -x $(BENCH)/bin/python || $(PYTHON) -m venv $(BENCH)
	$(BENCH)/bin/python -m pip install --quiet --disable-pip-version-check \
	    --requirement tests/bench/requirements.txt --editable .
	$(BENCH)/bin/python tests/bench/run.py --out $(BENCH)/results.json $(BENCH_OPTIONS)
	$(BENCH)/bin/python tests/bench/report.py $(BENCH)/results.json
	@echo "The page is book/benchmark.md; make book shows it."

mutants: $(TESTS) ## plant sixty faults, one at a time, and list those that no test notices
	$(BIN)/python tests/tools/mutants.py $(MUTANTS_OPTIONS)

lock: $(READY) ## renew the pins of all packages, with their hashes: the lab's, and its authors'
	$(COMPILE) --upgrade --all-extras --group authors --group test --output-file requirements-dev.txt
	cp requirements-dev.txt requirements.txt
	$(COMPILE) $(EXTRAS:%=--extra %) --output-file requirements.txt

dist: $(READY) ## build the wheel and the sdist into dist/
	rm -rf build dist
	$(BIN)/python -c 'from setuptools.build_meta import *; build_sdist("dist"); build_wheel("dist")'

clean: ## remove all that these commands made, .venv included
	rm -rf $(VENV) .venv-wolfram .venv-graders $(BENCH) _build build dist
	rm -rf book/_static/vendor *.egg-info
	rm -rf .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -prune -exec rm -rf {} +

$(BIN)/uv:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "The lab needs Python 3.11 or newer as '$(PYTHON)'."; \
	    echo "Name another one like this: make PYTHON=python3.12 ..."; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	    echo "'$(PYTHON)' cannot make environments."; \
	    echo "On Debian and Ubuntu: sudo apt install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(GET_UV)

$(READY): requirements.txt pyproject.toml .binder/overrides.json | $(BIN)/uv
	{ $(UV) --group build $(AUTHORS) && $(UV) --no-build-isolation --editable ".[$(subst $() ,$(COMMA),$(EXTRAS))]"; } || \
	    { echo "uv does not reach the packages. pip tries now; it takes six times as long."; \
	      $(PIP) --require-hashes --requirement requirements.txt && \
	      $(PIP) --no-deps --no-build-isolation --editable .; }
	@mkdir -p $(LAB_SETTINGS) && cp .binder/overrides.json $(LAB_SETTINGS)  # widgets stay in a notebook
	@find $(VENV) -path '*/pip/*' -name __pycache__ -prune -exec rm -rf {} +  # 8 MB that only make needs
	$(BIN)/python -c 'import matplotlib.font_manager'  # finds the fonts, once
	$(WARM)
	@touch $@

$(RAN): $(NOTEBOOKS) $(shell find labkit -name '*.py')
	@mkdir -p _build && touch _build/began
	$(NBVAL) --numprocesses 2 --dist loadfile $(if $(filter %.py,$?),$(NOTEBOOKS),$?)
	@mv _build/began $@

$(TESTS): $(READY)
	$(UV) --group test || $(PIP) --require-hashes --requirement requirements-dev.txt
	@touch $@
