# make demo      install into .venv and solve the main problem for the shipped patient
# make test      install into .venv; lint, types and tests
# make test-all  the same with the full-length solves
# make docs      build the documentation site into site/; any dead link or stale anchor stops it
# make lock      choose the newest versions of all dependencies and write them into requirements/
# make audit     look for known vulnerabilities in them
# make clean     remove .venv and what was built

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := pyproject.toml CMakeLists.txt \
  $(shell find pathwalker_cli native configs patient_data urdf -type f ! -name '*.pyc')

.PHONY: demo test test-all check docs lock audit clean

demo: $(VENV)/installed
	$(BIN)/pathwalker solve mapd-orthosis configs/mapd-orthosis.yaml --out runs/demo

test: check audit
	$(BIN)/pytest -n 2 --dist loadgroup

test-all: check
	$(BIN)/pytest -n 2 --dist loadgroup -m "slow or not slow"

check: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

# Every package comes in the version, and as one of the files, that its lock names. Without build
# isolation the extension is compiled against the very wheels that are installed, and only when its
# own sources change.
PIP_INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check
LOCKED = $(PIP_INSTALL) --require-hashes --only-binary :all:

$(VENV)/python: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/installed: $(VENV)/python requirements/install.txt $(SOURCES)
	$(LOCKED) -r requirements/install.txt
	$(PIP_INSTALL) --no-deps --no-build-isolation .
	touch $@

$(VENV)/installed-dev: $(VENV)/python requirements/dev.txt $(SOURCES)
	$(LOCKED) -r requirements/dev.txt
	$(PIP_INSTALL) --no-deps --no-build-isolation .
	touch $@ $(VENV)/installed

audit: $(VENV)/installed-dev
	$(BIN)/python requirements/audit.py requirements/dev.txt

LOCK = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --upgrade --generate-hashes \
  --no-emit-index-url --custom-compile-command "make lock" pyproject.toml $(VENV)/build.txt

lock: $(VENV)/python
	$(PIP_INSTALL) uv
	$(BIN)/python -c "import tomllib; \
	  print(*tomllib.load(open('pyproject.toml', 'rb'))['build-system']['requires'], sep='\n')" \
	  > $(VENV)/build.txt
	$(LOCK) --extra dev --extra docs --no-annotate -o requirements/dev.txt
	$(LOCK) --constraints requirements/dev.txt --no-annotate -o requirements/install.txt

clean:
	rm -rf $(VENV) build site
