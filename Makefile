# The commands of README.md. Each does its own set-up: a fresh clone with Python >= 3.10, pip and a
# Rust toolchain is enough, whatever environment is active. What they write is ignored by git (but for
# `make bench`, which refreshes benches/RESULTS.md).

PYTHON ?= python3
OUTPUT ?= out

# One folder, one profile (release) and one set of features (--workspace) for lints, tests,
# documentation and wheel: faer and nalgebra are compiled once.
export CARGO_TARGET_DIR := $(CURDIR)/target
CARGO_FLAGS := --release --workspace --locked

# What maturin tells pyo3's build script; told otherwise, pyo3 would be compiled at every change between
# the two.
AS_MATURIN = export PYO3_PYTHON="$(CURDIR)/$(BIN)/python"; \
	config=$$(ls -t "$$CARGO_TARGET_DIR"/maturin/pyo3-config-*.txt 2>/dev/null | head -n 1); \
	test -z "$$config" || export PYO3_BUILD_EXTENSION_MODULE=1 PYO3_CONFIG_FILE="$$config";

BIN := .venv/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Nothing of the caller's Python gets in.
unexport VIRTUAL_ENV CONDA_PREFIX PYTHONPATH PYTHONHOME PIP_USER PIP_TARGET PIP_PREFIX MYPYPATH
unexport PYTEST_ADDOPTS MPLBACKEND
# Cargo counts the cores itself; make's own job server would only confuse it.
unexport MAKEFLAGS MFLAGS

SOURCES := $(shell find rust python -name __pycache__ -prune -o -name '_core*.so' -o -print)

# One after another under `make -j` too: cargo uses all cores anyway.
.NOTPARALLEL:
.DELETE_ON_ERROR:
.PHONY: help test reproduce bench methods setup install check-format check-lints test-rust check-docs \
	test-python check-stubs clean

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1@\2/p' Makefile | awk -F@ '{ printf "%-18s %s\n", $$1, $$2 }'

test: check-format check-lints test-rust check-docs test-python check-stubs ## everything CI checks

reproduce: install ## the paper's studies: figures, data and reports into out/ (QUICK=1: shorter)
	$(BIN)/spim reproduce all --output "$(OUTPUT)" $(if $(QUICK),--quick)

check-format: setup ## formatting: rustfmt, ruff
	cargo fmt --all --check
	$(BIN)/python -m ruff format --check .

check-lints: setup ## lints: clippy, ruff
	$(BIN)/python -m ruff check .
	@echo cargo clippy $(CARGO_FLAGS) --all-targets -- -D warnings
	@$(AS_MATURIN) cargo clippy $(CARGO_FLAGS) --all-targets -- -D warnings

test-rust: ## tests of the Rust core
	cargo test $(CARGO_FLAGS)

check-docs: ## documentation of the Rust core
	RUSTDOCFLAGS="-D warnings" cargo doc $(CARGO_FLAGS) --no-deps

test-python: install ## tests of the installed wheel
	$(BIN)/python -m pytest

check-stubs: install ## python/spim/_core.pyi against the compiled module
	$(BIN)/python -m mypy.stubtest spim._core

setup: .venv/.dependencies ## .venv with the tools and packages of pyproject.toml

# A venv whose interpreter is gone is made anew.
$(shell test ! -e .venv || $(BIN)/python -c '' 2>/dev/null || rm -rf .venv)

.venv/.dependencies: pyproject.toml
	@command -v cargo >/dev/null || { echo "spim: no cargo on the path; install Rust 1.89 or newer" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit("spim: needs Python 3.10 or newer; say make PYTHON=..." if sys.version_info < (3, 10) else 0)'
	test -e .venv || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	$(BIN)/python -m pip install --quiet --group dev
	@touch $@

dist/.wheel: Cargo.toml Cargo.lock pyproject.toml $(SOURCES) | .venv/.dependencies
	rm -f dist/spim-*.whl
	$(BIN)/python -m maturin build --release --out dist --interpreter $(BIN)/python
	@touch $@

# Always, as it takes a second: whatever else was installed in .venv meanwhile, this wheel is tested.
install: dist/.wheel ## the wheel, built if need be, into .venv
	$(BIN)/python -m pip install --quiet --force-reinstall --no-deps dist/spim-*.whl

methods: setup ## measures every method anew: rust/core/method/measured.csv and docs/methods.md
	RENEW=1 cargo test $(CARGO_FLAGS) --test verify measured
	$(MAKE) install
	$(BIN)/python docs/methods.py > docs/methods.md

# The first lines of benches/RESULTS.md: what the tables were measured with.
define HEADING
import datetime, os, pathlib, platform, re, subprocess
from spim._versions import versions
cpuinfo = pathlib.Path("/proc/cpuinfo")
cpu = re.search("model name.*: (.*)", cpuinfo.read_text() if cpuinfo.exists() else "")
commit = subprocess.check_output(["git", "describe", "--always", "--dirty"], text=True).strip()
have = {name: versions()[name] for name in ("kernels", "python", "numpy")}
print("# Results of `make bench`\n")
print(f"{datetime.date.today()}, commit {commit}.", cpu[1] if cpu else platform.processor(), end="; ")
print(f"{os.cpu_count()} cores;", *(f"{name} {value};" for name, value in have.items()))
endef
export HEADING

bench: install ## all benches; refreshes benches/RESULTS.md
	mkdir -p out/bench
	@$(BIN)/python -c "$$HEADING" > out/bench/RESULTS.md
	cargo bench --workspace --locked --bench '*' > out/bench/rust.txt
	@{ printf '\n## cargo bench\n\n```\n'; \
		sed -n '/%/d; /time: /p; /thrpt: /p; /^[^ ][^ ]*$$/p' out/bench/rust.txt; \
		printf '```\n'; } >> out/bench/RESULTS.md
	@for script in benches/python/[a-z]*.py; do \
		echo "$(BIN)/python $$script --markdown"; \
		printf '\n## %s\n\n' "$$(basename "$$script" .py)" >> out/bench/RESULTS.md; \
		$(BIN)/python "$$script" --markdown >> out/bench/RESULTS.md || exit 1; \
	done
	@printf '\n## expm_speed, AVX2 forced\n\n' >> out/bench/RESULTS.md
	$(BIN)/python benches/python/expm_speed.py --markdown --level avx2 >> out/bench/RESULTS.md
	mv out/bench/RESULTS.md benches/RESULTS.md

clean: ## remove everything the other targets write
	rm -rf .venv target out dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find python tests benches -name __pycache__ -prune -exec rm -rf {} +
