# carom: every target sets up what it needs, works again and again, and works offline after the first time.
# PYTHON may name another CPython >= 3.11.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BENCH := crates/bench
PEERS := $(BENCH)/target/peers
CARGO ?= cargo
PIP_FLAGS := --quiet --disable-pip-version-check

.DEFAULT_GOAL := help
.PHONY: bench-instructions bench-threads bench-growth bench-accuracy help demo test test-player test-firefox check-player player playground bench-playground bench-player laws check bench bench-collide simbenchmark heaps bench-contact bench-contact-peers bench-contact-own bench-contact-hard bench-contact-piles bench-contact-stress docs look-at-site wheel test-rust test-python clean bench-peers bench-floor bench-peers-check bench-peers-setup

help:
	@echo "make demo    set up, run two scenes, write recordings, replay pages and plots to out/"
	@echo "make test    set up, run all tests"
	@echo "make laws    long laws: cases and benchmarks for their whole time, half an hour or more"
	@echo "make check   formatting, lints as errors, types"
	@echo "make player  build the replay page into the package; needs Node.js (ADR 14)"
	@echo "make playground       the engine in a page, player/dist-playground/playground.html; skipped loudly without Rust's target for WebAssembly (ADR 16)"
	@echo "make bench-playground steps per second of 500 bodies in that page"
	@echo "make test-firefox     the replay page in Firefox on a screen of Xvfb; skipped loudly where either is missing"
	@echo "make bench-player     how long the page of 1,000 bodies takes to load, and frames per second when scrubbed"
	@echo "make bench   milliseconds per step beside Rapier, as ratios"
	@echo "make bench-collide    what finding contacts costs, phase by phase"
	@echo "make bench-threads [THREADS=2]    what threads save, scheme by scheme, and that no bit depends on them"
	@echo "make bench-instructions [CHECK=1]    instructions of the hot kernels, beside the table's; needs valgrind"
	@echo "make bench-growth [PAIRS=100000]    what a pair that touches costs soft_step, from a hundred pairs to a million; memory"
	@echo "make bench-accuracy   auto and pgs alone to the same tolerances: time and residual"
	@echo "make bench-peers [SCENES=..] [ENGINES=..] [THREADS=1,2]    carom, Box2D, Box3D, Rapier, Jolt, MuJoCo and pymunk in one run; long"
	@echo "make bench-floor [SCENES=planar/rain] [ENGINES=carom/soft_step,box2d]    instructions and memory of a step of the race; needs valgrind"
	@echo "make simbenchmark     SimBenchmark's tasks with carom's schemes, beside the published figures"
	@echo "make heaps   boxes and hulls in a bin, 1000 bodies poured, a Kapla tower for 600 s: energy, overlap, books, cost; long"
	@echo "make bench-contact    contact solvers beside Siconos and Pinocchio on public problems, as ratios"
	@echo "make docs    the site in site/: guides, theory, gallery, API of Python and Rust; links and code checked"
	@echo "make look-at-site     the built site in a headless Chromium: formulas, requests, widths, replays; screenshots"

# --- set-up: a stamp per step, so that nothing runs twice and nothing needs the network twice ---

RUST_SOURCES := $(shell find crates/math crates/geometry crates/solver crates/world crates/scenes crates/python -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock

$(VENV)/made:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "carom needs CPython >= 3.11, this is " + sys.version)'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/tools: $(VENV)/made requirements.lock
	$(BIN)/python -m pip install $(PIP_FLAGS) -r requirements.lock
	@touch $@

# the package is installed in place: Python sources are used as they stand, the native module is rebuilt
# when a Rust source is newer
$(VENV)/package: $(VENV)/tools pyproject.toml $(RUST_SOURCES)
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m pip install $(PIP_FLAGS) --no-build-isolation --no-deps --editable .
	@touch $@

# --- what users call ---

demo: $(VENV)/package
	@mkdir -p out
	$(BIN)/carom run meshes_on_terrain --out out/meshes_on_terrain.h5
	$(BIN)/carom plot out/meshes_on_terrain.h5 --out out/meshes_on_terrain.png
	$(BIN)/carom run seven_objects --out out/seven_objects.h5
	$(BIN)/carom plot out/seven_objects.h5 --out out/seven_objects.png
	$(BIN)/carom view out/seven_objects.h5 --no-browser
	$(BIN)/carom view out/meshes_on_terrain.h5 --no-browser
	@echo
	@echo "Recorded: out/meshes_on_terrain.h5 (space, real meshes) and out/seven_objects.h5 (plane), plots beside them."
	@echo "Look at them: open out/meshes_on_terrain.html and out/seven_objects.html in a browser."

test: test-rust test-python test-player

# without examples and programs, of which each would compile the generic engine anew; their lints are part of `make check`
RUST_TESTS := --locked --workspace --exclude carom-python
test-rust:
	$(CARGO) test $(RUST_TESTS) --tests
	$(CARGO) test $(RUST_TESTS) --doc

test-python: $(VENV)/package
	$(BIN)/python -m pytest

# --- the replay page: built from player/, committed as python/carom/player/page.html (ADR 14) ---

PAGE := python/carom/player/page.html
NPM ?= npm
# where there is no Node.js the page as committed is used, and what needs Node.js says loudly that it is left out;
# with CI set it fails instead
NO_NODE = echo "=== SKIPPED: $(1) needs Node.js >= 20.19, which is not here ===" >&2; test -z "$$CI"

# not `npm ci`: it refuses a lock that lacks a tool's builds for other platforms, and mirrors of the registry do not carry
# all of those; versions and digests are those of the lock all the same, which is not written
player/node_modules/made: player/package.json player/package-lock.json
	cd player && $(NPM) install --no-save --no-audit --no-fund --silent
	@touch $@

player: player/node_modules/made
	cd player && $(NPM) run --silent build
	cp player/dist/index.html $(PAGE)

check-player:
	@if command -v node >/dev/null; then \
	  $(MAKE) --no-print-directory player/node_modules/made && cd player && $(NPM) run --silent check && $(NPM) run --silent build -- --logLevel warn && \
	  { cmp dist/index.html ../$(PAGE) || { echo "the committed page is not what player/ builds; run: make player" >&2; exit 1; }; }; \
	else $(call NO_NODE,the check of the replay page); fi

# the engine in a page; 3: no toolchain for WebAssembly, which is said loudly and is no failure
PLAYGROUND := player/dist-playground/playground.html
playground: player/node_modules/made
	@rm -f $(PLAYGROUND); bash tools/build_playground.sh; code=$$?; if [ $$code -eq 3 ]; then exit 0; fi; \
	  test $$code -eq 0 && cd player && $(NPM) run --silent build-playground -- --logLevel warn

# what a native build makes of the same scenes, an example of the playground's crate: seconds after `make test-rust`, whose crates it
# shares. Without a named target, for `--example` would build its tests; and not with the engine's own example, a minute more.
NATIVE_FINGERPRINTS = $(CARGO) test --quiet $(RUST_TESTS) --exclude carom --no-run

bench-playground: playground
	sh tools/install_chromium.sh
	cd player && node tests/bench_playground.mjs

# in a real browser, which tools/install_chromium.sh installs
test-player: $(VENV)/package
	@if ! command -v node >/dev/null; then $(call NO_NODE,the test of the replay page); \
	elif ! sh tools/install_chromium.sh; then \
	  echo "=== SKIPPED: the test of the replay page needs Chromium, which could not be installed ===" >&2; test -z "$$CI"; \
	else $(MAKE) --no-print-directory player/node_modules/made playground && $(NATIVE_FINGERPRINTS) && \
	  $(BIN)/python player/tests/pages.py player/tests/out && cd player && $(NPM) run --silent test; fi

# not part of `make test`: Debian's packages firefox-esr, xvfb and libgl1-mesa-dri are needed, CAROM_FIREFOX names another
NO_FIREFOX = echo "=== SKIPPED: the test of the replay page in Firefox needs $(1), which is not here ===" >&2; test -z "$$CI"
test-firefox: $(VENV)/package
	@if ! command -v node >/dev/null; then $(call NO_FIREFOX,Node.js); \
	elif ! test -x "$${CAROM_FIREFOX:-/usr/bin/firefox-esr}" && ! test -x /usr/bin/firefox; then $(call NO_FIREFOX,Firefox (firefox-esr)); \
	elif ! command -v Xvfb >/dev/null; then $(call NO_FIREFOX,Xvfb); \
	else $(MAKE) --no-print-directory player/node_modules/made playground && $(NATIVE_FINGERPRINTS) && \
	  $(BIN)/python player/tests/pages.py player/tests/out && cd player && node --test tests/firefox.mjs; fi

bench-player: $(VENV)/package player/node_modules/made
	sh tools/install_chromium.sh
	$(BIN)/python player/tests/pages.py player/tests/out --large
	cd player && node tests/bench.mjs

# what `make test` leaves out for its length; LAWS names some of them, as `make laws LAWS=kapla`
LAWS ?=
laws:
	$(CARGO) test --release --locked --package carom-tests --test all -- --ignored --nocapture --test-threads=2 --skip laws:: $(LAWS)

check: $(VENV)/tools check-player
	$(CARGO) fmt --all --check
	$(CARGO) fmt --all --check --manifest-path $(BENCH)/Cargo.toml
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings
	$(CARGO) clippy --locked --manifest-path $(BENCH)/Cargo.toml --package carom-bench-contact --all-targets -- -D warnings
	$(BIN)/ruff format --check python tests tools examples crates/bench/contact $(BENCH)/race
	$(BIN)/ruff check python tests tools examples crates/bench/contact $(BENCH)/race
	$(BIN)/mypy

bench:
	$(CARGO) run --release --locked --manifest-path crates/bench/Cargo.toml --

# a minute: pairs of shapes beside the library; scenes that stand still, processor time of bounds, pairs, contact points, touches
bench-collide:
	$(CARGO) bench --quiet --locked --package carom-geometry --bench pairs
	$(CARGO) run --quiet --release --locked --package carom-scenes --bin collide

# a minute: scenes on one thread and on several, in turn
bench-threads:
	$(CARGO) run --quiet --release --locked --package carom-scenes --bin threads -- $(THREADS)

# some minutes: what a pair that touches costs soft_step in scenes of a hundred pairs to a million, in time and memory; PAIRS=100000 stops there
PAIRS ?=
bench-growth:
	$(CARGO) run --quiet --release --locked --package carom-scenes --bin growth -- $(PAIRS)

# some minutes: auto and pgs alone to the same tolerances; fails where pgs is cheaper
bench-accuracy:
	$(CARGO) run --quiet --release --locked --package carom-scenes --bin accuracy

# instructions of the hot kernels beside those of the table, by valgrind: minutes, and no matter how busy the machine is;
# CHECK=1 leaves the table and fails where a kernel takes a twentieth more
CHECK ?=
bench-instructions:
	$(CARGO) build --quiet --release --locked --package carom-scenes --bin instructions
	$(PYTHON) tools/count_instructions.py target/release/instructions $(BENCH)/results/instructions.csv $(if $(CHECK),--check)

# rolling, bouncing, cubes of balls: minutes; STEPS=1e-4,1e-3 asks for other step lengths, TASKS=666,bouncing for some
# tasks alone, SCHEMES=events,events_within_the_step,fixed_step for some ways. It ends with 1 when a run with events misses a demand, and writes its results all the same;
# rows of other runs stay.
STEPS ?=
TASKS ?=
SCHEMES ?=
simbenchmark:
	$(CARGO) run --quiet --profile dist --locked --package carom-scenes --bin simbenchmark -- --out crates/bench/results \
	  $(if $(STEPS),--dt $(STEPS)) $(if $(TASKS),--tasks $(TASKS)) \
	  $(if $(SCHEMES),--schemes $(SCHEMES))

# an hour or more in all; HEAPS=bin,pour,kapla names some tasks, LIMIT the seconds that each may take, TIME the seconds to
# simulate. Rows are written every few seconds: a run may be stopped at any time. It ends with 1 when a run misses a demand.
HEAPS ?=
TIME ?=
heaps:
	$(CARGO) run --quiet --profile dist --locked --package carom-scenes --bin heaps -- --out crates/bench/results \
	  $(if $(HEAPS),--tasks $(HEAPS)) $(if $(LIMIT),--limit $(LIMIT)) $(if $(TIME),--time $(TIME))

# carom and its peers in one race, in a target folder of its own, for the processor at hand. SCENES=pyramid:20,spatial/hulls
# names scenes, ENGINES=carom,box3d engines (carom/SCHEME:SOLVER one way of carom's), SLEEPING=off or on, PATIENCE the seconds
# that an engine may take per scene. Rows are written after each scene: a run may be stopped at any time.
SCENES ?=
ENGINES ?=
THREADS ?=
SLEEPING ?=
REPEATS ?=
PATIENCE ?=
RACE := $(BENCH)/race
RACE_CARGO = . $(PEERS)/race.env && RUSTFLAGS="-C target-cpu=native" $(CARGO)
RACE_FLAGS := --release --locked --manifest-path $(RACE)/Cargo.toml --target-dir $(BENCH)/target/native
bench-peers-setup: $(VENV)/made
	PYTHON=$(abspath $(BIN)/python) sh $(RACE)/setup.sh $(PEERS)

bench-peers: $(VENV)/tools bench-peers-setup
	$(RACE_CARGO) run $(RACE_FLAGS) --features "$$RACE_FEATURES" -- \
	  --out $(BENCH)/results --python $(abspath $(PEERS))/race/bin/python \
	  $(if $(SCENES),--scenes $(SCENES)) $(if $(ENGINES),--engines $(ENGINES)) $(if $(THREADS),--threads $(THREADS)) \
	  $(if $(SLEEPING),--sleeping $(SLEEPING)) $(if $(REPEATS),--repeats $(REPEATS)) $(if $(PATIENCE),--patience $(PATIENCE))
	$(BIN)/python $(RACE)/plot.py "$$(ls -t $(BENCH)/results/*/peers.csv | head -1)" out/peers.png

# instructions of a step, and memory from beyond the second cache, scene by scene: minutes each, for valgrind is slow
bench-floor: $(VENV)/tools bench-peers-setup
	$(RACE_CARGO) build $(RACE_FLAGS) --features "$$RACE_FEATURES"
	$(BIN)/python $(RACE)/count.py $(BENCH)/target/native/release/carom-race $(BENCH)/results/floor.csv \
	  $(or $(SCENES),planar/rain,planar/tumbler) $(or $(ENGINES),carom/soft_step,box2d) $(PATIENCE)

# every engine on a small pyramid, what the scenes promise, the judge; and the race's lints
bench-peers-check: bench-peers-setup
	$(RACE_CARGO) clippy $(RACE_FLAGS) --features "$$RACE_FEATURES" --all-targets -- -D warnings
	RACE_PYTHON=$(abspath $(PEERS))/race/bin/python; export RACE_PYTHON; \
	  $(RACE_CARGO) test $(RACE_FLAGS) --features "$$RACE_FEATURES"

# contact solvers on the problems of a folder, beside what can be installed here; CAROM_CONTACT_PROBLEMS names it
CAROM_CONTACT_PROBLEMS ?= ../shared/contact_problems
PROBLEMS ?= *
TOLERANCES ?= 1e-4,1e-8
SOLVERS ?=
REFERENCES ?= siconos,pinocchio
CONTACT := $(BENCH)/target/release/carom-contact

bench-contact-peers: $(VENV)/made
	PYTHON=$(abspath $(BIN)/python) sh $(BENCH)/contact/setup.sh $(PEERS)

$(CONTACT): FORCE
	$(CARGO) build --quiet --release --locked --manifest-path $(BENCH)/Cargo.toml --package carom-bench-contact
.PHONY: FORCE
FORCE:

bench-contact: $(VENV)/tools $(CONTACT) $(if $(filter none,$(REFERENCES)),,bench-contact-peers)
	PYTHONPATH=$(BENCH)/contact $(BIN)/python -m bench_contact "$(CAROM_CONTACT_PROBLEMS)" --problems "$(PROBLEMS)" \
	  --tolerances "$(TOLERANCES)" --solvers "$(SOLVERS)" --references "$(REFERENCES)" --peers "$(abspath $(PEERS))" \
	  --ours "$(abspath $(CONTACT))" --out $(BENCH)/results $(BENCH_CONTACT_FLAGS)

# our own problems: mass ratios, arches, cards, tables by every solver; cost against size
LARGEST ?= 100000
bench-contact-own bench-contact-piles bench-contact-hard: LIMIT ?= 60
bench-contact-own: $(CONTACT)
	$(CONTACT) structures --out $(BENCH)/results $(if $(SOLVERS),--solvers $(SOLVERS))
	$(CONTACT) scaling --out $(BENCH)/results --largest $(LARGEST) --limit $(LIMIT) $(if $(SOLVERS),--solvers $(SOLVERS))

# exact on what costs it most: lattices of balls pushed at random and sheared walls, up to 5,000 contacts, by seed
bench-contact-hard: $(CONTACT)
	$(CONTACT) hard --out $(BENCH)/results --seeds $(SEEDS) --limit $(LIMIT)

# piles that carom has poured: what sweeps and exact reach, in what time and memory
PILES ?= 1000,12000
bench-contact-piles: $(CONTACT)
	$(CONTACT) scaling --piles $(PILES) --tolerance 1e-6 --limit $(LIMIT) --out $(BENCH)/results $(if $(SOLVERS),--solvers $(SOLVERS))

# random impulses and friction on the problems of the folder and on our own small ones
SEEDS ?= 1
bench-contact-stress: $(VENV)/tools $(CONTACT)
	PYTHONPATH=$(BENCH)/contact $(BIN)/python -m bench_contact.flatten "$(CAROM_CONTACT_PROBLEMS)" $(BENCH)/target/flat
	$(CONTACT) stress --folder $(BENCH)/target/flat --seeds $(SEEDS) --out $(BENCH)/results \
	  $(if $(SOLVERS),--solvers $(SOLVERS))

# the site, in site/: gallery, pages, rustdoc, and a check of links, anchors, requests to outside and public names. A gallery's
# page is made again only when its program or the package has changed; DOCTREES keeps what Sphinx has read; site/ begins empty, so that
# nothing is left in it that the pages no longer have.
DOCTREES := target/doctrees
docs: $(VENV)/package
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --workspace --no-deps
	$(BIN)/python tools/make_gallery.py
	$(BIN)/python tools/make_site_tables.py
	rm -rf site
	$(BIN)/sphinx-build -q -W --keep-going -j 2 -b html -d $(DOCTREES) docs site
	cp -r target/doc site/rust
	if [ -d docs/gallery/made/replays ]; then cp -r docs/gallery/made/replays site/gallery/made/; fi
	if [ -f $(PLAYGROUND) ]; then cp $(PLAYGROUND) site/playground.html; else cp tools/no_playground.html site/playground.html; \
	  echo "=== SKIPPED: the site has no playground, because it is not built; run: make playground ===" >&2; fi
	$(BIN)/python tools/check_site.py site
	$(BIN)/python -m pytest tests/contracts
	@echo "Site: site/index.html"

# the built site in a real browser: formulas, requests, widths, replays; and its screenshots. Two minutes.
look-at-site: $(VENV)/package
	$(BIN)/python tools/look_at_site.py site docs/screenshots

wheel: $(VENV)/tools
	$(BIN)/maturin build --profile dist --locked --out dist

clean:
	rm -rf target out dist site docs/_made docs/gallery/made player/node_modules player/dist player/dist-playground player/tests/out $(VENV) \
	  crates/bench/target
