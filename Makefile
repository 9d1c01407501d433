# `make help` lists the targets. Every target that needs it makes the virtual environment first.

PY := .venv/bin/python
READY := .venv/.ready
# The first Python that is new enough; override with `make PYTHON=/path/to/python`.
PYTHON = $(shell for p in python3 python3.14 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$p; break; }; done)

.DEFAULT_GOAL := help
.PHONY: help setup run test browser slow fuzz lint golden bench docs papers clean

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/\1|\2/p' Makefile | awk -F '|' '{ printf "  make %-8s %s\n", $$1, $$2 }'

setup: $(READY)  ## make .venv with the pinned dependencies

$(READY): pyproject.toml .ci/constraints.txt
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed, and none was found." >&2; exit 1; }
	test -x $(PY) || $(PYTHON) -m venv .venv
	$(PY) -m pip install --quiet --disable-pip-version-check -c .ci/constraints.txt -e '.[dev]'
	@touch $@

run: $(READY)  ## solve specs/first_order.yaml into runs/first_order
	$(PY) -m inputdesign_cli solve specs/first_order.yaml -o runs/first_order

test: $(READY)  ## the tests, but for the slow ones
	$(PY) -m pytest -n auto --maxprocesses 4

browser: $(READY)  ## the tests of pages in a real browser (Debian: apt-get install chromium)
	$(PY) -m pip install --quiet --disable-pip-version-check -c .ci/constraints.txt -e '.[browser]'
	@command -v chromium chromium-browser google-chrome >/dev/null || { echo "no Chromium was found" >&2; exit 1; }
	$(PY) -m pytest -m browser

slow: $(READY)  ## the slow tests: seconds that lighter ones cover, random plants, Monte Carlo
	$(PY) -m pytest -m slow -n auto --maxprocesses 4

fuzz: $(READY)  ## extreme and broken specs for FUZZ_SECONDS (60): no crash, no hang, no nonsense
	$(PY) -m tests.fuzzing

lint: $(READY)  ## ruff and mypy
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy

golden: $(READY)  ## compare with the golden results
	$(PY) -m inputdesign_cli check

bench: $(READY)  ## time the solvers
	@set -e; for script in benchmarks/*.py; do \
		test -e "$$script" || { echo "there are no benchmarks yet"; break; }; \
		echo "$$script"; $(PY) "$$script"; done

docs: $(READY)  ## write docs/cli.md from the help texts
	$(PY) docs/make_cli_page.py

papers: $(READY)  ## write docs/papers.md: the figures of the papers beside ours
	$(PY) docs/make_papers_page.py

clean:  ## remove caches and builds (runs/ and .venv stay)
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis dist
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
