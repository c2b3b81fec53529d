# make demo       a steel bar breaks a glass bar: submitted over HTTP, run on all cores, checked, drawn (demo.png)
# make test       linters, types and every fast test; two groups of tests run at the same time
# make lint       ruff, the checker of words and of commit subjects (tests/plain_words.py) and mypy
# make bench      speed, and speed against error: tables in build/bench, 15 minutes (BENCH=quick: 2, BENCH=long: 60)
# make accuracy   docs/verification/accuracy.md: the verification catalogue, measured here (ACCURACY=quick: no studies)
# make reference  docs/reference/case.md, docs/reference/http.md and the JSON schema of cases, from the sources
# make docs       the documentation site in build/site; a broken link is an error
# make drill      the long tests: 800 faults (table in build/drill; continues an earlier drill; DRILL="--shard 1/4"),
#                 then studies of minutes; as root on Debian it installs Slurm, libfaketime and systemd
#
# Each target first updates .venv to the versions of requirements.lock, if that file or pyproject.toml has changed.
# Commands that take more than 10 s print progress. Kernels are compiled while pip installs packages that the kernels
# do not need. The target `kept` writes the bytecode of changed sources before the tests, so that the hundreds of test
# processes do not compile these sources again. It also does so if the environment sets PYTHONDONTWRITEBYTECODE, as
# many containers do.

PYTHON ?= $(firstword $(foreach name,python3.11 python3.12 python3.13 python3,$(shell command -v $(name))))
BIN := .venv/bin
READY := .venv/.ready
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
KEPT := PYTHONDONTWRITEBYTECODE= $(BIN)/python
HOUSES := cases client server worker
CHECK := $(BIN)/pytest -q -m "not slow" -p no:cacheprovider
SERVICES := tests/parallel tests/server tests/client

# $(call progress,words,command) runs a command and prints every 5 s how long it has taken so far.
progress = @echo "$(1)"; began=$$(date +%s); \
	while sleep 5 >/dev/null 2>&1; do echo "$(1): $$(($$(date +%s) - began)) s"; done & clock=$$!; \
	trap "kill $$clock" EXIT; $(2)

.PHONY: demo test lint style types check kept check-solver check-services bench accuracy reference docs drill clean
.DEFAULT_GOAL := test

demo: $(READY)
	$(BIN)/conoid run glass_steel_demo --view demo.png --check
	@echo 'on the page: $(BIN)/conoid serve --runs runs/local --no-auth, then open the address that it prints'

test: style
	@$(MAKE) --no-print-directory --jobs 2 check-solver check-services types

lint: style types
	$(BIN)/python -m tests.plain_words --subjects

style: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m tests.plain_words

types: $(READY)
	$(BIN)/mypy

check: check-solver check-services

kept: $(READY)
	@$(KEPT) -m compileall -q $(HOUSES)

check-solver: kept
	$(CHECK) $(SERVICES:%=--ignore=%) tests

check-services: kept
	$(CHECK) $(SERVICES)

bench: $(READY)
	$(BIN)/python -m tests.bench

accuracy: $(READY)
	$(BIN)/python -m tests.bench.book

reference: $(READY)
	$(BIN)/conoid schema --out cases/case.schema.json
	$(BIN)/conoid schema --page --out docs/reference/case.md
	$(BIN)/python -m conoid.server.answers.reference > docs/reference/http.md

docs: $(READY)
	@$(PIP) --no-deps -r docs/requirements.lock
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "to read it: $(BIN)/python -m http.server --bind 127.0.0.1 --directory build/site 8760, then http://127.0.0.1:8760"

drill: $(READY)
	@if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && ! { command -v slurmctld && command -v faketime && command -v systemd-analyze; } >/dev/null; then \
		apt-get install -y --no-install-recommends slurm-wlm munge faketime systemd || echo "without Slurm and systemd: their tests are skipped"; fi
	@$(PIP) "schemathesis>=4.32" || echo "without schemathesis: its test is skipped"
	@wrong=0; $(BIN)/python -m tests.drill $(DRILL) || wrong=1; \
		$(BIN)/python -m pytest -q -m slow --timeout 3600 --ignore tests/bench tests || wrong=1; exit $$wrong

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Conoid needs Python 3.11 or newer; make PYTHON=/path/to/python")'
	$(call progress,making .venv,$(PYTHON) -m venv .venv)
	$(call progress,installing what the worker needs,$(PIP) -c requirements.lock setuptools \
		&& $(PIP) -c requirements.lock --no-build-isolation -e ".[worker]")
	$(call progress,installing the rest,$(KEPT) -m conoid.worker.kernels.compile & kernels=$$!; \
		$(PIP) --no-deps -r requirements.lock || { kill $$kernels; exit 1; }; wait $$kernels)
	@$(KEPT) -c "import conoid.client.cli, conoid.client.drawing.render, conoid.server.serve, matplotlib.pyplot, pandas"
	@mkdir -p build/types/conoid
	@for house in $(HOUSES); do ln -sfn ../../../$$house build/types/conoid/$$house; done
	@touch $(READY)

clean:
	rm -rf .venv build *.egg-info .mypy_cache .pytest_cache .ruff_cache
