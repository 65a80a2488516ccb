# Two commands: `make demo` and `make test`. Both create what they need.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: demo test lint demos benchmark clean

demo: $(VENV)/installed ## install, then balance the paper's five-bar: tables, files, plots, animation
	$(BIN)/fivebar-pin demo --out results/five_bar --overwrite

test: $(VENV)/installed-test ## install with the test tools, then run the tests
	$(BIN)/python -m pytest

lint: $(VENV)/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

demos: $(VENV)/installed
	@set -e; for demo in demos/*.py; do echo "== $$demo"; $(BIN)/python $$demo --headless; done

benchmark: $(VENV)/installed
	$(BIN)/python -m benchmarks

clean:
	rm -rf $(VENV) results

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/installed-test: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .[test]
	@touch $@
