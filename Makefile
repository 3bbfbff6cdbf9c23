# From Debian 12 with Python 3.11, pip and make alone. `make help` lists what there is.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO := sites/lighthouse
UV := uv==0.13.9
PIP := --disable-pip-version-check --no-input

NPM := PATH="$(CURDIR)/$(BIN):$$PATH" npm

.PHONY: help
help:
	@echo "make demo        scan the modelled lighthouse and build its tour (FULL=1: every point)"
	@echo "make install     what tourgen needs, and .venv/bin/tourgen"
	@echo "make viewer      compile what visitors' browsers run"
	@echo "make test        every test but the benches"
	@echo "make lint        ruff, mypy and the viewer's types"
	@echo "make bench       accuracy of the demo against its ground truth"
	@echo "make bench-fidelity   every method and its peers against it (BENCH='--room chamber1')"
	@echo "make bench-speed      time and memory beside what one does by hand (BENCH='--points 1300000')"
	@echo "make bench-rooms      how many rooms use two cores"
	@echo "make bench-viewer     what a visit takes, and other viewers beside it (BENCH='--room stairs')"
	@echo "make soak        a build killed at 30 moments, half an hour of wandering, hours of a kiosk"
	@echo "make pictures    screenshots of the demo for README and docs"
	@echo "make lock        pin the newest versions, with their hashes"
	@echo "make clean       drop all that make made"

# ---- What is installed: each stamp is older than nothing it came from, so once is enough.

.PHONY: install
install: system $(VENV)/.tourgen viewer

.PHONY: system
system: NEEDED_BY :=
system:
	$(install_debian)

.PHONY: system-bench
system-bench: NEEDED_BY := --tests --bench
system-bench:
	$(install_debian)

.PHONY: system-tests
system-tests: NEEDED_BY := --tests
system-tests:
	$(install_debian)

define install_debian
@missing="$$($(PYTHON) -m tourgen.doctor $(NEEDED_BY))"; \
if [ -z "$$missing" ]; then exit 0; fi; \
line="apt-get update --quiet=2 && DEBIAN_FRONTEND=noninteractive apt-get install --quiet=2 --yes --no-install-recommends $$missing >/dev/null"; \
if [ "$$(id -u)" = 0 ]; then sh -c "$$line"; \
elif sudo --non-interactive true 2>/dev/null; then sudo sh -c "$$line"; \
else printf 'error: this machine lacks %s\n\nhint: sudo sh -c "%s"\n' "$$missing" "$$line"; exit 1; fi
endef

# Debian's python3 comes without ensurepip: pip fills the environment from outside.
$(BIN)/python:
	$(PYTHON) -m venv --without-pip $(VENV)

$(VENV)/.packages: requirements/build.txt requirements/test.txt | $(BIN)/python
	$(PYTHON) -m pip $(PIP) --python $(BIN)/python install --quiet --only-binary :all: \
		--require-hashes -r requirements/build.txt -r requirements/test.txt
	@touch $@

$(VENV)/.tourgen: $(VENV)/.packages pyproject.toml hatch_build.py
	$(BIN)/python -m pip $(PIP) install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.bench: requirements/bench.txt | $(VENV)/.packages
	$(PYTHON) -m pip $(PIP) --python $(BIN)/python install --quiet --only-binary :all: \
		--require-hashes -r requirements/bench.txt
	@touch $@

# Compiles only where static/ has changed since.
.PHONY: viewer
viewer: $(VENV)/.packages
	@$(BIN)/python hatch_build.py

tests/node_modules/.package-lock.json: tests/package-lock.json | $(VENV)/.packages
	cd tests && $(NPM) ci --no-audit --no-fund --ignore-scripts
	@touch $@

tests/peers/node_modules/.package-lock.json: tests/peers/package-lock.json | $(VENV)/.packages
	cd tests/peers && $(NPM) ci --no-audit --no-fund --ignore-scripts
	@touch $@

# ---- What is made

.PHONY: demo
demo: install
	$(BIN)/python -m tourgen.simulate $(DEMO) $(if $(FULL),--full)
	$(BIN)/tourgen build $(DEMO)
	@printf '\nWalk through it with:  %s serve %s\n' $(BIN)/tourgen $(DEMO)

.PHONY: pictures
pictures: demo system-tests
	$(BIN)/python docs/pictures.py $(DEMO)/site

# ---- What is judged

.PHONY: test
test: install system-tests tests/node_modules/.package-lock.json
	cd static && $(NPM) test
	$(BIN)/pytest --numprocesses 2 --dist loadfile --no-loadscope-reorder --max-worker-restart 0

.PHONY: lint
lint: install
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	cd static && $(NPM) run check

# No test is ended for lasting longer than any of `make test` may.
LASTING := -o faulthandler_timeout=0

.PHONY: soak
soak: demo system-tests tests/node_modules/.package-lock.json
	$(BIN)/pytest $(LASTING) tests/commands/test_kills.py --kills 30
	$(BIN)/pytest $(LASTING) tests/browser/test_wander.py --wander 1800 --tour $(DEMO)
	$(BIN)/pytest $(LASTING) -rP tests/commands/test_kiosk_lasting.py --tour $(DEMO) --acts 10000
	$(BIN)/pytest $(LASTING) -rP tests/commands/test_kiosk_screen.py --acts 10000
	$(BIN)/pytest $(LASTING) -rP tests/browser/test_kiosk_soak.py --kiosk-visits 160 --kiosk-seconds 3600

.PHONY: bench
bench: demo
	$(BIN)/python tests/peers/score.py $(DEMO) --table docs/benchmarks.md

# Hours on 2 cores. Each room is written when judged; meshes and measures stay in build/fidelity.
.PHONY: bench-fidelity
bench-fidelity: demo system-bench $(VENV)/.bench
	$(BIN)/python tests/peers/fidelity.py $(DEMO) --gallery ../shared/scans/gallery_sim \
		--write docs/benchmarks.md $(BENCH)

# Alone on the machine: what else runs is timed too.
.PHONY: bench-speed
bench-speed: demo system-bench $(VENV)/.bench
	$(BIN)/python tests/peers/speed.py --demo $(DEMO) --write docs/benchmarks.md $(BENCH)

# Alone on the machine, too.
.PHONY: bench-rooms
bench-rooms: demo
	$(BIN)/python tests/peers/many_rooms.py --demo $(DEMO) --write docs/benchmarks.md $(BENCH)

# And so too.
.PHONY: bench-viewer
bench-viewer: demo system-tests tests/node_modules/.package-lock.json \
		tests/peers/node_modules/.package-lock.json
	$(BIN)/python tests/peers/viewer.py $(DEMO) --write docs/benchmarks.md $(BENCH)

# ---- What is kept up

# Without the configuration of this machine, so that no address or path of it is written.
.PHONY: lock
lock: COMPILE = uv pip compile --no-config --quiet --upgrade --universal --python-version 3.11 \
	--generate-hashes --no-annotate --no-header --no-emit-index-url --no-emit-find-links
lock: $(VENV)/.packages
	$(PYTHON) -m venv --without-pip $(VENV)/lock
	$(PYTHON) -m pip $(PIP) --python $(VENV)/lock/bin/python install --quiet $(UV)
	PATH=$(VENV)/lock/bin:$$PATH; \
	$(COMPILE) requirements/build.in -o requirements/build.txt && \
	$(COMPILE) pyproject.toml -c requirements/build.txt -o requirements/run.txt && \
	$(COMPILE) pyproject.toml --extra test -c requirements/build.txt -c requirements/run.txt \
		-o requirements/test.txt && \
	$(COMPILE) pyproject.toml --extra bench -c requirements/test.txt -o requirements/bench.txt
	rm -rf $(VENV)/lock
	for folder in static tests tests/peers; do \
		(cd $$folder && rm -f package-lock.json && $(NPM) install --package-lock-only --ignore-scripts); \
	done

.PHONY: clean
clean:
	rm -rf $(VENV) static/dist static/node_modules tests/node_modules \
		tests/peers/node_modules dist build \
		sites/*/scans sites/*/sounds sites/*/truth sites/*/site sites/*/.tourgen
