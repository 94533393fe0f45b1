# From a fresh clone: `make install`, `make run`, `make test`. Each sets up .venv if need be.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# Python keeps the bytecode of what it imports: the tests start hundreds of processes.
unexport PYTHONDONTWRITEBYTECODE

# pip is silent: 43 s of CPU, and the downloads.
INSTALLS = @echo "pip installs desim in $(VENV), once: a minute, or as long as the downloads take"

.PHONY: install run test tests quick check lint types validate loop bench dist schema docs

install: $(VENV)/.installed

run: $(VENV)/.installed
	$(BIN)/desim run scenarios/maze_30.yaml

# The type checker runs beside the tests: it has one core's work for a minute.
test: lint
	$(MAKE) --no-print-directory -j 2 types tests

# worksteal: a worker takes a row of tests, so that what they share is made once.
tests: $(VENV)/.installed-test
	$(BIN)/pytest -n 2 --dist worksteal -m "not validation"

# The linter, the type checker, the words of the code and of the pages, and the rules of the design.
check: lint types
	$(BIN)/pytest tests/test_architecture.py -k "not help"

lint: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/python tools/prose.py
	$(BIN)/codespell desim netmodels tools docs tests scenarios *.md

types: $(VENV)/.installed-test
	$(BIN)/mypy

# The tests nearest to a change, by imports: under a minute.
quick: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/python tools/quick.py

# The models against everything measured elsewhere: network models and middleware.
validate: $(VENV)/.installed-test
	$(BIN)/desim validate
	$(BIN)/pytest -n 2 -m validation

# Real programs in the guest: its tests, and each of the scenarios twice, with equal digests. A
# guest has one processor.
loop: $(VENV)/.installed-test
	$(BIN)/pytest -n 2 --dist worksteal tests/loop
	$(BIN)/python tools/loop_twice.py

bench: $(VENV)/.installed
	$(BIN)/python tools/bench.py

# The sdist and the wheel, in dist/; the wheel is installed and tried outside of the checkout.
dist: $(VENV)/.installed-test
	.ci/dist

# The documentation site, in build/site/html.
docs: $(VENV)/.installed-docs
	$(BIN)/python tools/build_site.py

# The keys of scenarios, for editors: .vscode/settings.json reads this file.
schema: $(VENV)/.installed
	$(BIN)/desim schema > .vscode/scenario.schema.json

$(VENV)/.installed: pyproject.toml
	$(INSTALLS)
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install --quiet --editable .
	@touch $@

$(VENV)/.installed-test: pyproject.toml
	$(INSTALLS)
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install --quiet --editable '.[test]'
	@touch $(VENV)/.installed $@

$(VENV)/.installed-docs: pyproject.toml
	$(INSTALLS)
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV)
	@$(BIN)/pip install --quiet --editable '.[docs]'
	@touch $(VENV)/.installed $@
