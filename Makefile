# Two targets for a newcomer: `make demo` and `make test`. Both set up their own environment.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready

CORES := $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)

CLOCK  := tests/wire tests/contract
# The shares of `make virtual` run beside each other, on two cores each in one process: what a
# process does not collect costs it nothing. More cores give each share workers of its own.
EACH   ?= $(shell expr $(CORES) / 3)
BESIDE := --dist loadfile --no-loadscope-reorder
SHARES := $(addprefix virtual-,system engine parts clock)
virtual-system: SHARE := tests/system
virtual-engine: SHARE := tests/unit/engine
virtual-parts:  SHARE := tests/unit --ignore=tests/unit/engine tests/helpers
virtual-clock:  SHARE := $(CLOCK)

# Wide matrices are not what this project computes; one BLAS thread is faster and repeatable.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

# Some images forbid it: then each of the tests' hundreds of processes compiles every module anew.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help long demo demo-wire test lint types imports virtual $(SHARES) realtime \
  mutants installed dist wire campaign bench benches fuzz docs paper clean

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

demo: $(READY) ## The paper's plastic sphere on the simulated rig; ends with a report
	$(BIN)/stepload run procedures/plastic-sphere.yaml --dry-run

demo-wire: $(READY) ## A whole plan with real drivers against emulated devices, in real time
	$(BIN)/python -m stepload_verify.trials.demo_wire

test: $(READY) ## Everything CI runs; of what runs side by side each part is shown when it is over
	@$(MAKE) --no-print-directory --jobs=8 --output-sync=target lint types imports virtual
	@$(MAKE) --no-print-directory realtime

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

imports: $(READY)
	$(BIN)/lint-imports --no-cache

virtual: $(SHARES) ## The tests that no clock on the wall can fail; in four shares with --jobs

$(SHARES): $(READY)
	$(BIN)/pytest $(SHARE) -m 'not realtime and not long' -n $(EACH) $(BESIDE)

realtime: $(READY) ## What a meter of the host's stalls stands beside
	$(BIN)/pytest $(CLOCK) -m 'patient and not long' -n $(shell expr $(CORES) + 1) --dist worksteal
	$(BIN)/pytest $(CLOCK) -m 'realtime and not patient and not long' -n $(shell expr 2 \* $(CORES)) \
	  --dist worksteal

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

wire: $(READY) ## Everything over the wire, with every fault of the documents under a whole run, real time
	$(BIN)/pytest tests/wire -m 'long or not long' --durations=10

long: $(READY) ## Tests that are too long for every commit: more of each kind of run, memory, more plans
	$(BIN)/pytest tests --ignore=tests/wire -m long -n $(CORES) $(BESIDE) --durations=10

campaign: $(READY) ## The fault campaign: 100,000 runs with one fault (hours; resumable)
	$(BIN)/stepload campaign procedures/campaign.yaml --runs 100000 --out campaign

bench: $(READY) ## Intervals against truth (five minutes); every figure of speed beside the kept table (fifteen)
	$(BIN)/python bench/sharpness.py --runs 100
	$(BIN)/python bench/sharpness.py --runs 30 --unstated
	$(BIN)/python bench/table.py

benches: $(READY) ## Each bench by itself, with what the table leaves out
	@for script in bench/*.py; do case $$script in */_*|*/fuzz_*|*/table.py) continue;; esac; \
	  echo "== $$script"; $(BIN)/python $$script || exit 1; done

fuzz: $(READY) ## Property tests on new examples; random frames into every decoder, 10 million each
	$(BIN)/pytest tests/unit --hypothesis-profile=explore
	$(BIN)/python bench/fuzz_decoders.py --frames 10000000

docs: $(READY) ## The site of all pages in site/; it asks the network for nothing
	$(BIN)/zensical build --clean --strict

paper: $(READY) ## Regenerate docs/paper.md
	$(BIN)/stepload paper --out docs/paper.md

clean: ## Remove the environment and what was generated
	rm -rf $(VENV) .cache dist runs campaign mutants .pytest_cache .mypy_cache .ruff_cache .hypothesis
