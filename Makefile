# Two commands do everything on a fresh machine with Python 3.11+ (with venv) and make:
#   make demo    a synthetic road, its video, and the overtakes recognised in it
#   make test    the tests that every change runs; `make test-long` has the others that must pass
# One makes what is committed already: `make detector` renders worlds and trains the networks on them (hours of a core).
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT := out/demo
TEST_ARGS ?=

.PHONY: demo test test-long test-slow test-cluster check check-api bench detector serve clean

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/installed-dev: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

$(VENV)/installed-cluster: $(VENV)/installed-dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[cluster]'
	@touch $@

demo: $(VENV)/installed
	$(BIN)/dyknow demo --out $(OUT)

# In the order of the files: what takes longest lies in tests/, and the short examples of the packages fill both workers' ends.
# The tests start processes, which need not compile the packages again.
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

# The two together are all tests but the slow ones.
test: $(VENV)/installed-dev
	$(PYTEST) -m 'not long and not slow' $(TEST_ARGS)

test-long: $(VENV)/installed-dev
	$(PYTEST) -m 'long and not slow' $(TEST_ARGS)

test-slow: $(VENV)/installed-dev
	$(PYTEST) -m slow $(TEST_ARGS)

# On a Ray cluster of this machine; Ray is 240 MB, so the other targets do without, and skip these tests.
test-cluster: $(VENV)/installed-cluster
	$(BIN)/python -m pytest -m 'slow or not slow' tests/service/runs/jobs/test_cluster.py $(TEST_ARGS)

check: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Requests that the OpenAPI description allows, and some that it does not, by schemathesis: the answers must be as described.
check-api: $(VENV)/installed-dev
	$(BIN)/python -m pytest -m slow tests/service/api/test_described_api.py $(TEST_ARGS)

bench: $(VENV)/installed-dev
	$(BIN)/python -m benchmarks
	$(BIN)/python -m benchmarks.check_executors --cases 10000

# What is rendered or trained already is kept; out/detector has the weights, their recipes stand in vision/networks/weights.
detector: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[train]'
	$(BIN)/python -m training above out/detector
	$(BIN)/python -m training low out/detector

serve: $(VENV)/installed
	$(BIN)/dyknow serve sqlite:///$(OUT)/log.db

clean:
	rm -rf $(VENV) out .pytest_cache .mypy_cache .ruff_cache .hypothesis build dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
