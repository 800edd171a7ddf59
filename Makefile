# Every target does all its own set-up, again and again without harm.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
unexport PYTHONDONTWRITEBYTECODE  # or each process of a flight compiles the package again

in_environment := source ./env.sh &&
# An installed ROS puts pytest plug-ins of its own in the way.
pytest := python -m pytest --disable-plugin-autoload -p randomly -p timeout -p hypothesispytest --timeout 300 --durations 25
shared := -p xdist -n auto --dist worksteal

.PHONY: help setup demo test test-fast check bench verify fuzz wheel docs lock clean force

help:
	@echo "make demo        fly the default scenario on the node graph, record it, and write its page"
	@echo "make test        lint, types and the test suite"
	@echo "make test-fast   the quick ones of the tests that start no node processes"
	@echo "make check       lint and types"
	@echo "make bench       measure speed, into build/bench.json"
	@echo "make verify      long runs against independent programs, into docs/verification/"
	@echo "make fuzz        hostile bytes and texts through all readers, a million of them"
	@echo "make wheel       dist/formation_gnc-*.whl, for pip and without ROS"
	@echo "make docs        the documentation site, into build/site/"
	@echo "make setup       the environment alone; then: source env.sh"
	@echo "make lock        pin the newest versions that requirements*.in allow (takes uv)"
	@echo "make clean       remove what was built; .venv and bags/ stay"

setup: install/.ready

demo: setup
	@$(in_environment) formation-gnc sil leader_follower --page

check: setup
	@$(in_environment) ruff check . && ruff format --check . && mypy

test: check
	@$(in_environment) $(pytest) $(shared) -m "not slow"

test-fast: setup
	@$(in_environment) $(pytest) $(shared) --hypothesis-profile fast -m "not sil and not slow and not thorough"

bench: .venv/.verify
	@$(in_environment) python -m bench

verify: .venv/.verify
	@$(in_environment) $(pytest) --timeout 0 -m slow && \
		$(pytest) $(shared) --timeout 0 --hypothesis-profile search -m "not sil and not slow" && python -m verification

fuzz: setup
	@$(in_environment) python -m tools.fuzz

wheel: .venv/.ready
	@tools/make_wheel.sh .venv/bin/python dist

# Strict: a link or anchor that leads nowhere is an error.
docs: .venv/.docs
	@NO_MKDOCS_2_WARNING=1 .venv/bin/mkdocs build
	@echo "open build/site/index.html, or read it with: .venv/bin/mkdocs serve"

# Which ROS, and for which place: a change of either is a new environment.
.ros: force
	@ros=$$(tools/find_ros.sh) || exit; here="$$ros for $(CURDIR)"; [[ $$here == "$$(cat $@ 2>&1)" ]] || echo "$$here" > $@

.venv/.ready: .ros requirements.lock tools/make_venv.sh tools/ros_prefix.py
	@tools/make_venv.sh
	@touch $@

.venv/.verify: install/.ready requirements-verify.lock
	@.venv/bin/python -m pip install -qq --disable-pip-version-check --require-hashes --no-deps -r requirements-verify.lock
	@touch $@

.venv/.docs: .venv/.ready requirements-docs.lock
	@.venv/bin/python -m pip install -qq --disable-pip-version-check --require-hashes --no-deps -r requirements-docs.lock
	@touch $@

# Python files are linked, not copied, so that a change to one needs no build; messages, data files and entry points do.
install/.ready: .venv/.ready tools/build.sh package.xml setup.py setup.cfg msg_defs/package.xml msg_defs/CMakeLists.txt \
		$(wildcard msg_defs/msg msg_defs/msg/*.msg params params/* campaigns campaigns/* launch launch/* scripts/*)
	@tools/build.sh
	@touch $@

lock := uv pip compile --python-version 3.12 --only-binary :all: --no-binary empy --generate-hashes --no-annotate \
	--custom-compile-command "make lock" --upgrade --quiet
lock:
	$(lock) requirements.in -o requirements.lock
	$(lock) requirements-verify.in -c requirements.lock -o requirements-verify.lock
	$(lock) requirements-docs.in -c requirements.lock -o requirements-docs.lock

clean:
	rm -rf build dist install log .mypy_cache .pytest_cache .ruff_cache .hypothesis
