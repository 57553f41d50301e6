# Two targets a newcomer needs: `make demo` and `make test`. Both make the environment in .venv first.
PYTHON ?= python3
SPINDLE = .venv/bin/spindle
READY = .venv/ready

.PHONY: demo test lint bench blind clean

demo: $(READY)
	$(SPINDLE) run scenes/hdd_2003 --out out/hdd_2003

test: $(READY) lint
	.venv/bin/pytest

lint: $(READY)
	.venv/bin/ruff check .
	.venv/bin/mypy

blind: $(READY)
	.venv/bin/python -m tests.blind
	.venv/bin/python -m tests.blind_variants

bench: $(READY)
	.venv/bin/python -m tests.bench

$(READY): pyproject.toml
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'Thermospindle needs Python 3.11 or newer')"
	$(PYTHON) -m venv .venv
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	touch $(READY)

clean:
	rm -rf .venv out
