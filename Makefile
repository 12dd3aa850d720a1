# make demo      install into .venv and solve the main problem for the shipped patient
# make test      install into .venv; lint, types and tests
# make test-all  the same with the full-length solves
# make docs      build the documentation site into site/; any dead link or stale anchor stops it
# make clean     remove .venv and what was built

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := pyproject.toml CMakeLists.txt \
  $(shell find pathwalker_cli native configs patient_data urdf -type f ! -name '*.pyc')

.PHONY: demo test test-all check docs clean

demo: $(VENV)/installed
	$(BIN)/pathwalker solve mapd-orthosis configs/mapd-orthosis.yaml --out runs/demo

test: check
	$(BIN)/pytest -n 2 --dist loadgroup

test-all: check
	$(BIN)/pytest -n 2 --dist loadgroup -m "slow or not slow"

check: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# Without build isolation the extension is compiled against the very wheels that are installed, and
# only when its own sources change.
$(VENV)/build-tools: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -c "import tomllib; \
	  print(*tomllib.load(open('pyproject.toml', 'rb'))['build-system']['requires'], sep='\n')" \
	  > $(VENV)/build-requires.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r $(VENV)/build-requires.txt
	touch $@

$(VENV)/installed: $(VENV)/build-tools $(SOURCES)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation .
	touch $@

$(VENV)/installed-dev: $(VENV)/build-tools $(SOURCES)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation ".[dev,docs]"
	touch $@ $(VENV)/installed

clean:
	rm -rf $(VENV) build site
