# Two targets for a newcomer: `make demo` and `make test`. Both set up their own environment.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
KEPT   := $(VENV)/.compiled

CORES := $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)

# One test at a time on each core and one more, for many of them wait (those that wait
# longest come first). Twice as many as cores took a fifth more of the processors' time.
WORKERS ?= $(shell expr $(CORES) + 1)
BESIDE  := --dist loadfile --no-loadscope-reorder

# Wide matrices are not what this project computes; one BLAS thread is faster and repeatable.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

# Some images forbid it: then each of the tests' hundreds of processes compiles every module anew.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help compiled long demo demo-wire test lint types imports source made virtual realtime \
  test-under-load mutants installed dist wire campaign bench benches fuzz docs paper clean

help: ## Show this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

$(READY): pyproject.toml verify/pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "stepload needs Python 3.11 or newer; say which with: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@# uv takes a tenth of pip's time. Where it reaches no index of its own accord, pip has its settings.
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'uv<1' && \
	  $(BIN)/uv pip install --quiet --python $(BIN)/python -e '.[dev]' -e verify || \
	  $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -e '.[dev]' -e verify
	@touch $@

# Every worker imports every test file: once compiled by one process, that takes a third of the time.
$(KEPT): $(READY)
	-@$(BIN)/pytest --collect-only -qq >/dev/null
	@touch $@

compiled: $(READY) ## The hot modules as machine code, once per change; without a C compiler as they are
	@$(BIN)/python compile_hot.py

demo: compiled ## The paper's plastic sphere on the simulated rig; ends with a report
	$(BIN)/stepload run procedures/plastic-sphere.yaml --dry-run

demo-wire: compiled ## A whole plan with real drivers against emulated devices, in real time
	$(BIN)/python -m stepload_verify.trials.demo_wire

test: $(READY) ## Everything CI runs; of what runs side by side each part is shown when it is over
	@$(MAKE) --no-print-directory --jobs=5 --output-sync=target lint types imports source compiled
	@$(MAKE) --no-print-directory made
	@$(MAKE) --no-print-directory realtime

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

imports: $(READY)
	$(BIN)/lint-imports --no-cache

# Whole runs take the engine as `make` made it. What puts stand-ins into it needs its Python source.
RUNS   := $(addprefix tests/unit/engine/test_, align_runs.py common_error.py material_range_runs.py \
  moved_zero_runs.py nulling_runs.py retract_guard.py run_campaign_findings.py run_loop.py \
  run_rules.py schedule_of_runs.py slow_sensors.py unkind_worlds.py wrong_wiring.py) \
  tests/unit/verify
MADE   := tests/system $(RUNS) tests/wire
PARTS  := tests/unit tests/helpers tests/system/test_breakage.py
SOURCE := tests/contract $(PARTS)
CLOCK  := tests/wire tests/contract

virtual: source made ## The tests that no clock on the wall can fail

source: $(KEPT) ## Those of parts, on Python's source
	$(BIN)/pytest $(PARTS) $(RUNS:%=--ignore=%) -m 'not realtime and not long' -n $(WORKERS) $(BESIDE)

made: compiled $(KEPT) ## Those of whole runs and commands, on compiled modules
	STEPLOAD_PURE= $(BIN)/pytest $(MADE) --ignore=tests/system/test_breakage.py \
	  -m 'not realtime and not long' -n $(WORKERS) $(BESIDE)

realtime: compiled $(KEPT) ## Drivers and their emulators, then what a meter of the host's stalls stands beside
	$(BIN)/pytest tests/contract -m 'not realtime and not long' -n $(CORES) --dist worksteal
	STEPLOAD_PURE= $(BIN)/pytest $(CLOCK) -m 'patient and not long' -n $(CORES) $(BESIDE)
	STEPLOAD_PURE= $(BIN)/pytest $(CLOCK) -m 'realtime and not patient and not long' -n $(shell expr 2 \* $(CORES)) \
	  --dist worksteal

test-under-load: $(READY) ## Both of these, ten times beside busy loops and ten times with stops
	$(BIN)/python tests/helpers/under_load.py --runs 10 -- $(MAKE) --no-print-directory virtual realtime

mutants: $(READY) ## Every operator of mutmut on the safety rooms; a test must fail each time (long)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[mutants]'
	$(BIN)/mutmut run --max-children 1 | tail -n 1
	$(BIN)/mutmut results

dist: $(READY) ## sdist and wheel of both packages in dist/, checked
	rm -rf dist
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'build>=1.2,<2' 'twine>=6,<8'
	$(BIN)/python -m build --outdir dist .
	$(BIN)/python -m build --outdir dist verify
	$(BIN)/twine check --strict dist/*

installed: ## The wheels in a clean environment, outside the checkout
	.ci/installed

wire: compiled ## Everything over the wire, with every fault of the documents under a whole run, real time
	STEPLOAD_PURE= $(BIN)/pytest tests/wire -m 'long or not long' --durations=10

long: compiled ## Tests that are too long for every commit: more of each kind of run, memory, more plans
	$(BIN)/pytest $(SOURCE) $(RUNS:%=--ignore=%) -m long -n $(CORES) $(BESIDE)
	STEPLOAD_PURE= $(BIN)/pytest $(RUNS) tests/system --ignore=tests/system/test_breakage.py \
	  -m long --durations=10

campaign: compiled ## The fault campaign: 100,000 runs with one fault (hours; resumable)
	$(BIN)/stepload campaign procedures/campaign.yaml --runs 100000 --out campaign

bench: compiled ## Intervals against truth (five minutes); every figure of speed beside the kept table (fifteen)
	STEPLOAD_PURE= $(BIN)/python bench/sharpness.py --runs 100
	STEPLOAD_PURE= $(BIN)/python bench/sharpness.py --runs 30 --unstated
	$(BIN)/python bench/table.py

benches: compiled ## Each bench by itself, with what the table leaves out
	@for script in bench/*.py; do case $$script in */_*|*/fuzz_*|*/table.py) continue;; esac; \
	  echo "== $$script"; $(BIN)/python $$script || exit 1; done

fuzz: $(READY) ## Property tests on new examples; random frames into every decoder, 10 million each
	$(BIN)/pytest tests/unit --hypothesis-profile=explore
	$(BIN)/python bench/fuzz_decoders.py --frames 10000000

docs: $(READY) ## The site of all pages in site/; it asks the network for nothing
	$(BIN)/zensical build --clean --strict

paper: compiled ## Regenerate docs/paper.md
	$(BIN)/stepload paper --out docs/paper.md

clean: ## Remove the environment and what was generated
	rm -rf $(VENV) .cache .compiled dist runs campaign mutants .pytest_cache .mypy_cache .ruff_cache .hypothesis
