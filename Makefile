# Two targets a newcomer needs: `make demo` and `make test`. Both make the environment in .venv first.
PYTHON ?= python3
SPINDLE = .venv/bin/spindle
READY = .venv/ready

# Compiled modules are kept, whatever the surroundings say: else each of the tests' processes compiles the program and pytest's rewritten tests anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test test-all lint bench growth blind torture fuzz faults release-check docs clean

demo: $(READY)
	$(SPINDLE) run scenes/hdd_2003 --out out/hdd_2003

test: $(READY) lint
	.venv/bin/pytest -n auto --dist worksteal

test-all: $(READY) lint
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test,cluster]'
	.venv/bin/pytest -n auto --dist worksteal -m ''

lint: $(READY)
	.venv/bin/ruff check .
	.venv/bin/mypy

# A campaign a seed, as many as SEEDS says; what is in out/blind/results.jsonl already is not made again.
SEEDS ?= 1000 1300
blind: $(READY)
	.venv/bin/python -m tests.blind.study --seeds $(SEEDS)
	.venv/bin/python -m tests.blind.score

# Random machines and damaged files: a result that keeps the laws of mechanics, or a named error, and the counts at the end. 5000 are 11,375 machines
# and more damaged files than that, for hours; EXAMPLES=100 takes minutes.
EXAMPLES ?= 5000
torture: $(READY)
	TORTURE_EXAMPLES=$(EXAMPLES) .venv/bin/pytest tests/torture -m ''

# Every reader of files under atheris, SECONDS each; what is found stands in out/fuzz. For one: .venv/bin/python -m tests.fuzz uff --seconds 600
SECONDS ?= 60
fuzz: $(READY)
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[fuzz]'
	.venv/bin/python -m tests.fuzz --seconds $(SECONDS)

# The documentation as one static site in out/site; its own libraries come with it.
docs: $(READY)
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[docs]'
	.venv/bin/python -m sphinx -q -b html docs/site out/site

# Every verb that writes killed with SIGKILL while it does, KILLS times in all; full disks, read-only folders, closed pipes and the like.
KILLS ?= 100
faults: $(READY)
	FAULTS_KILLS=$(KILLS) .venv/bin/pytest tests/faults -m ''

# Wheel and source package in clean environments: Python 3.11 to 3.13, newest and least dependencies; CHECK="--pythons 3.11 --tests tests/literature".
release-check: $(READY)
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[release]'
	.venv/bin/python -m tests.release_check $(CHECK)

bench: $(READY)
	.venv/bin/python -m tests.bench

# Cost against the size of the work, drawn; ROSS_PYTHON and EMA_PYTHON may name Pythons that have ROSS and sdypy-EMA.
growth: $(READY)
	.venv/bin/python -m tests.bench_growth --picture docs/growth.png

$(READY): pyproject.toml setup.py constraints.txt
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'Thermospindle needs Python 3.11 or newer')"
	$(PYTHON) -m venv .venv
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test]'
	touch $(READY)

clean:
	rm -rf .venv out
