# `make app` and `make test` do everything on a fresh Debian or Ubuntu machine with Python 3.11.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin

# `make app` alone installs what the app needs (extra `app`); any other goal installs what developers need (extra
# `dev`, with torch), which serves the app as well. Each has a stamp of its own.
ifeq ($(MAKECMDGOALS)$(wildcard .venv/.ready),app)
EXTRA := app
STAMP := .venv/.ready-app
else
EXTRA := dev
STAMP := .venv/.ready
endif

LIBRARY := finlab/core/libfinlab.$(if $(filter Darwin,$(shell uname)),dylib,so)
HOST_PORT ?= 8080

# Whatever the shell says, what is imported is compiled once: tests start hundreds of processes.
export PYTHONDONTWRITEBYTECODE :=

# Tests and benchmarks share few cores with a browser; one thread each is faster than many that wait.
THREADS := OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# glibc hands large arrays back to the system at once, and asks for them anew: kept, tests take a twentieth less.
THREADS += MALLOC_TRIM_THRESHOLD_=1073741824 MALLOC_MMAP_THRESHOLD_=1073741824

.DEFAULT_GOAL := help
.PHONY: test-pythons docs schemas figures help setup core core-test golden app board-tools test fuzz test-all test-near test-durations mutate test-fast check format checkpoint wheel wheels sdist wheel-check clean

help:
	@echo "make setup        make .venv with all that developers need, pinned in constraints.txt (gigabytes, with torch)"
	@echo "make core         compile the C files of finlab/core, a second; setup does it where they changed"
	@echo "make core-test    the core's own tests, in C, by cmake and ctest"
	@echo "make golden       write the golden robots of these tests, with the answers of oracles"
	@echo "make app          serve the app on http://127.0.0.1:$(HOST_PORT); installs what it needs and no more"
	@echo "make test         every test, browser tests included; of long tables of cases a share"
	@echo "make test-all     every test and every case"
	@echo "make fuzz         a million mutated robots and wild wrenches for the core in C, under sanitizers"
	@echo "make test-pythons  tests near the core by Python 3.10 and 3.13, where they are installed"
	@echo "make test-near    the tests near what was changed since the branch main, a minute"
	@echo "make test-durations  time every test, by which make test-near chooses"
	@echo "make mutate       small random faults, and whether near tests find them: make mutate SEED=1 COUNT=60"
	@echo "make test-fast    every test but those of the browser and the packaging"
	@echo "make check        ruff, ruff format and mypy"
	@echo "make schemas      write the JSON Schema of layout files"
	@echo "make figures      the tables of figures in docs/*.md, or of one page: make figures PAGE=evaluation"
	@echo "make docs         the site in build/site: runs every block and example, and checks every link"
	@echo "make format       let ruff correct what it can"
	@echo "make checkpoint   train the networks that are shipped (hours)"
	@echo "make wheels       build the wheels of Linux, macOS and Windows; make sdist the sources"
	@echo "make wheel-check  build them, install this machine's in an empty environment of each Python here and try it"

setup: $(STAMP) $(LIBRARY)

$(STAMP): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "finlab needs Python 3.10 or newer: apt-get install python3"; exit 1; }
	test -x $(BIN)/pip || tools/make-venv "$(PYTHON)"
	$(BIN)/pip install --disable-pip-version-check --no-compile -c constraints.txt hatchling -e '.[$(EXTRA)]'
	@touch $@

core $(LIBRARY): $(STAMP) hatch_build.py $(wildcard finlab/core/*.h finlab/core/src/*.[ch])
	$(BIN)/python hatch_build.py

app: setup
	$(BIN)/finlab app --port $(HOST_PORT)

core-test:
	cmake -S finlab/core -B build/core
	cmake --build build/core
	cd build/core && ctest --output-on-failure

golden: setup
	$(THREADS) $(BIN)/python -m tests.golden_robots

# What compiles and runs the C export, and where it stands in Debian.
BOARD_TOOLS := gcc g++ clang cmake aarch64-linux-gnu-gcc qemu-aarch64 arm-none-eabi-gcc qemu-system-arm
BOARD_PACKAGES := gcc g++ clang libclang-rt-dev cmake gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user \
    gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm

board-tools:
	@for tool in $(BOARD_TOOLS); do command -v $$tool >/dev/null || exec tools/apt-install $(BOARD_PACKAGES); done

test: setup board-tools
	@tools/find-browser || tools/apt-install chromium fonts-dejavu-core || tools/no-browser
	$(THREADS) $(BIN)/python -m pytest -n 2 --dist worksteal --ignore tests/browser $(CASES)
	$(THREADS) $(BIN)/python -m pytest -n 2 --dist worksteal tests/browser $(CASES)

fuzz: setup board-tools
	FUZZ=250000 $(BIN)/python -m pytest -n 2 -m "" -o faulthandler_timeout=0 -k fuzzer tests/core

test-pythons: setup
	tools/other-pythons

test-all: CASES := -m ""
test-all: test

test-near: setup
	$(BIN)/python tools/near_tests.py

# Processor seconds of tests, in tests/durations.json: after many tests have come or gone.
test-durations: setup
	$(THREADS) $(BIN)/python -m pytest -n 2 --dist worksteal --ignore tests/browser --ignore tests/packaging \
	    -q -p tools.durations

SEED ?= 0
COUNT ?= 60

mutate: setup
	$(BIN)/python tools/mutate.py --seed $(SEED) --count $(COUNT)

test-fast: setup
	$(THREADS) $(BIN)/python -m pytest -n 2 --dist loadfile --ignore tests/browser --ignore tests/packaging

check: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/clang-format --dry-run -Werror $(CORE_FILES)
	$(BIN)/mypy

CORE_FILES = $(wildcard finlab/core/*.h finlab/core/src/*.[ch] finlab/core/tests/test_*.c finlab/core/tests/golden.h \
    finlab/deploy/c_files/*.c finlab/deploy/c_stubs/*.c)

figures: setup
	$(THREADS) $(BIN)/python tools/figures.py $(PAGE)

schemas: setup
	$(BIN)/python tools/schemas.py

docs: setup
	NO_MKDOCS_2_WARNING=1 $(THREADS) $(BIN)/python -m mkdocs build --strict --quiet

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(CORE_FILES)

# The checkpoints `default` and `paper`.
checkpoint: setup
	$(BIN)/finlab train mdn -o runs/default --preset shipped
	$(BIN)/finlab train surrogate -o runs/surrogate --preset shipped
	$(BIN)/finlab train allocator -o runs/paper --preset shipped --surrogate runs/surrogate

WHEEL := $(BIN)/python -m pip wheel --disable-pip-version-check --no-deps --no-build-isolation -w dist .

wheel: setup
	$(WHEEL)

wheels: setup
	$(BIN)/pip install --disable-pip-version-check -q -c constraints.txt ziglang
	for target in $$($(BIN)/python -c 'import hatch_build as b; print(*b.TARGETS)'); do \
	    FINLAB_TARGET=$$target $(WHEEL) || exit 1; done

sdist: setup
	$(BIN)/python -m hatchling build -t sdist -d dist

wheel-check: wheel wheels
	tools/wheel-check

clean:
	rm -rf dist build test-results .mypy_cache .pytest_cache .ruff_cache .hypothesis
