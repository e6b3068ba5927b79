# Every target prepares what it needs: on a machine with Python 3.10 or later and make only,
# `make demo` and `make test` work in a fresh clone.

VENV ?= .venv
BIN := $(VENV)/bin
PY := $(BIN)/python
# ARGS: further options of pytest, for each run of a target
TESTS := $(PY) -m pytest $(ARGS)
# Side by side on the cores there are; kernels share them
PARALLEL := --numprocesses auto --maxprocesses 4 --dist worksteal
HEADERS = $(shell find dmc_cli tests -name '*.h')
# Tests that run kernels in their own process
CHECKED = tests/bits tests/field tests/contouring tests/mesh tests/measures tests/processing tests/test_same_bytes.py
SECONDS ?= 60
AREA ?= processing
COUNT ?= 60
SEED ?= 0
export WARP_CACHE_PATH ?= $(CURDIR)/.cache/warp
# Tests start the program hundreds of times: each would compile all modules where the shell forbids to keep that
test test-all test-gpu test-faults cov: export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help demo setup lock format lint types test test-all test-gpu test-faults fuzz mutants bench bench-methods bench-volumes bench-gpu cov docs smoke ci clean

# The Python that was named, or the first that is new enough, whatever it is called
FIND_PYTHON = for name in $(or $(PYTHON),python3 python python3.13 python3.12 python3.11 python3.10 python3.14); do \
	command -v $$name >/dev/null 2>&1 && \
	$$name -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))' >/dev/null 2>&1 && \
	{ echo $$name; exit 0; }; done; exit 1
NO_PYTHON = $(if $(PYTHON),$(PYTHON) is no,no) Python 3.10 or later with venv$(if $(PYTHON),, was found); install one \
	(on Debian and Ubuntu: python3 python3-venv) or name it: make PYTHON=/path/to/python

# Where a Python is named and the environment has another version, the environment is made anew
VERSION_OF = $(shell $(1) -c 'import sys; print(sys.version_info[:3])' 2>/dev/null || echo none)
ifneq ($(and $(PYTHON),$(wildcard $(PY))),)
ifneq ($(call VERSION_OF,$(PYTHON)),$(call VERSION_OF,$(PY)))
OTHER_PYTHON := other-python
.PHONY: other-python
endif
endif

# With LOCKED=1 the versions are those that the tests last passed with, for the Python that there is
LOCK_FILE = locks/$$($(PY) -c 'import sys; print("{}.{}".format(*sys.version_info))').txt
LOCK = $(if $(LOCKED),--constraint $(LOCK_FILE))
AS_LOCKED = $(if $(LOCKED),$(VENV)/.locked)

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

$(PY): $(OTHER_PYTHON)
	@python=$$($(FIND_PYTHON)) || { echo "$(NO_PYTHON)" >&2; exit 1; }; \
	echo "creating $(VENV) with $$python"; "$$python" -m venv --clear $(VENV)

# The stamps depend on pyproject.toml: a changed dependency is installed by the next make. With LOCKED=1 so is a changed
# lock, and what was installed without one
$(VENV)/.locked: $(wildcard locks/*.txt) | $(PY)
	@touch $@

$(VENV)/.installed: pyproject.toml $(AS_LOCKED) $(OTHER_PYTHON) | $(PY)
	$(PY) -m pip install --quiet --disable-pip-version-check $(LOCK) -e .
	@touch $@$(if $(LOCKED),,; rm -f $(VENV)/.locked)

$(VENV)/.installed-dev: pyproject.toml $(AS_LOCKED) $(OTHER_PYTHON) | $(PY)
	$(PY) -m pip install --quiet --disable-pip-version-check $(LOCK) -e '.[dev]'
	@touch $@ $(VENV)/.installed$(if $(LOCKED),,; rm -f $(VENV)/.locked)

demo: $(VENV)/.installed ## convert a real CT of a head and say where the mesh is
	@mkdir -p demo
	$(BIN)/dmc convert sample_data/dicom/head_ct demo/skull.ply -i 300 --border closed --report demo/skull.json --force
	@echo "the mesh is demo/skull.ply, its report demo/skull.json; any mesh viewer opens the mesh"

setup: $(VENV)/.installed-dev ## create the environment with all that development needs; LOCKED=1: in the versions of locks/

lock: $(VENV)/.installed-dev ## write down the versions that are installed
	$(PY) -m pip freeze --exclude-editable --disable-pip-version-check > $(LOCK_FILE)

format: $(VENV)/.installed-dev ## format the code and apply the safe fixes
	$(BIN)/ruff format
	$(BIN)/ruff check --fix
	$(BIN)/clang-format -i $(HEADERS)

lint: $(VENV)/.installed-dev ## ruff, formatting of Python and C++, import contracts, spelling
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/clang-format --dry-run -Werror $(HEADERS)
	$(BIN)/lint-imports
	$(BIN)/typos

types: $(VENV)/.installed-dev ## mypy, strict on host code
	$(BIN)/mypy

test: $(VENV)/.installed-dev ## the tests on CPU, without the slow ones
	$(TESTS) $(PARALLEL) -m "not slow and not gpu"

test-all: $(VENV)/.installed-dev ## all tests on CPU, hypothesis at length; then quick ones with launches by Warp, and checked
	$(TESTS) $(PARALLEL) -m "not gpu" --hypothesis-profile=thorough
	$(TESTS) $(PARALLEL) -m "not slow and not gpu" --launches-by-warp
	$(TESTS) $(PARALLEL) -m "not slow and not gpu" --checked $(CHECKED)

test-gpu: $(VENV)/.installed-dev ## the tests on CUDA; fails where there is no device
	$(TESTS) -m gpu --require-cuda

test-faults: $(VENV)/.installed-dev ## signals at random moments, full disks: outputs stay whole
	$(TESTS) tests/faults

fuzz: $(VENV)/.installed-dev ## damage files of every format for SECONDS (60) and read them
	$(PY) -m tests.fuzz --seconds $(SECONDS)

mutants: $(VENV)/.installed-dev ## put COUNT (60) faults into AREA (processing), chosen by SEED (0), and see which the tests notice
	$(PY) -m tests.mutants --area $(AREA) --count $(COUNT) --seed $(SEED)

bench: $(VENV)/.installed-dev ## time surface and mesh beside other programs, a whole convert beside its floor, DICOM beside plain reading
	$(PY) benchmarks/surface.py --out surface
	$(PY) benchmarks/surface.py --threads 1 --fast --out surface-one-thread
	$(PY) benchmarks/mesh.py --out mesh
	$(PY) benchmarks/measures.py --out measures
	$(PY) benchmarks/labels.py --out labels
	$(PY) benchmarks/parts.py --out parts
	$(PY) benchmarks/size.py --out size
	$(PY) benchmarks/memory.py --out memory
	$(PY) benchmarks/convert.py --out convert
	$(PY) benchmarks/dicom.py --out dicom
	$(PY) benchmarks/dicom_study.py --out dicom-study

bench-methods: $(VENV)/.installed-dev ## time all methods of contouring beside other programs
	$(PY) benchmarks/methods.py --out methods

bench-volumes: $(VENV)/.installed-dev ## compare all methods on all real volumes of DMC_DATA
	$(PY) benchmarks/volumes.py --out volumes

bench-gpu: $(VENV)/.installed-dev ## the same on CUDA; fails where there is no device
	$(PY) benchmarks/surface.py --device cuda:0 --out surface-cuda

cov: $(VENV)/.installed-dev ## coverage of the host code
	$(TESTS) -m "not slow and not gpu" --cov --cov-report=term

docs: $(VENV)/.installed-dev ## refresh what the README shows of outputs and options, and the codes in docs/formats.md
	$(PY) -m tests.docs.readme
	$(PY) -m tests.docs.formats
	$(PY) -m tests.docs.reproduction

smoke: $(VENV)/.installed-dev ## the source archive is complete; the wheel that is made of it works where nothing else is installed
	rm -rf build/smoke && mkdir -p build/smoke
	$(PY) -m build --outdir build/smoke . > build/smoke/log
	tar -tzf build/smoke/*.tar.gz | cut -d/ -f2- | LC_ALL=C sort > build/smoke/packed
	@missing=$$(git ls-files | LC_ALL=C sort | LC_ALL=C comm -13 build/smoke/packed -); \
	[ -z "$$missing" ] || { echo "not in the source archive:" $$missing >&2; exit 1; }
	$(PY) -m venv build/smoke/venv
	build/smoke/venv/bin/python -m pip install --quiet --disable-pip-version-check build/smoke/*.whl
	cd build/smoke && venv/bin/dmc --version && venv/bin/dmc convert synth:torus:32 torus.ply -i 0 --require closed,manifold

ci: lint types test smoke ## what has to pass before a change goes in

clean: ## remove build products and caches; the environment stays
	rm -rf build dist demo .cache .pytest_cache .ruff_cache .mypy_cache .import_linter_cache .hypothesis .coverage
	find . -name __pycache__ -type d -not -path './$(VENV)/*' -prune -exec rm -rf {} +
