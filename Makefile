# make demo   steel breaks glass: submitted over HTTP, run on 2 MPI ranks, watched live, checked, drawn (demo.png)
# make test   linters, types and every test that takes seconds
# make bench  speed, and speed against error, in 15 minutes: tables in build/bench (BENCH=quick: 2, BENCH=long: 60)
# make drill  the long tests: studies and failures that take minutes
#
# Each target first brings .venv to the versions of requirements.lock, when that file or pyproject.toml has changed.

PYTHON ?= $(firstword $(foreach name,python3.11 python3.12 python3.13 python3,$(shell command -v $(name))))
BIN := .venv/bin
READY := .venv/.ready
HOUSES := cases client server worker

.PHONY: demo test lint style types check bench drill clean
.DEFAULT_GOAL := test

demo: $(READY)
	$(BIN)/conoid run glass_steel_demo --ranks 2 --view demo.png --check

test: style
	@$(MAKE) --no-print-directory --jobs 2 types check

lint: style types

style: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

check: $(READY)
	$(BIN)/pytest -q -m "not slow"

bench: $(READY)
	$(BIN)/python -m tests.bench

drill: $(READY)
	$(BIN)/python -m pytest -q -m slow --timeout 3600 --ignore tests/bench tests

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Conoid needs Python 3.11 or newer; make PYTHON=/path/to/python")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@mkdir -p build/types/conoid
	@for house in $(HOUSES); do ln -sfn ../../../$$house build/types/conoid/$$house; done
	@touch $(READY)

clean:
	rm -rf .venv build *.egg-info .mypy_cache .pytest_cache .ruff_cache
