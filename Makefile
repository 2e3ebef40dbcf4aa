# The list of commands. `make` alone prints it.
.DEFAULT_GOAL := help
.PHONY: help build deccube paper test lint unit doc readers bench bench-peers bench-decimate library-bench cluster reliability fuzz fuzz-check golden pictures docs clean

CARGO ?= cargo
TARGET := $(or $(CARGO_TARGET_DIR),target)
ISOSPLINE := $(TARGET)/release/isospline
# The models of [TK] Fig. 9-15, in its order.
PAPER := torus_regular torus dodecahedron double_torus mcmullen chair deccube
# What reads bytes from outside.
FUZZ_TARGETS := formula config obj jsurf vm npz journal artifact
FUZZ_SECONDS ?= 120
# One view for pictures that stand side by side.
DRAW_CUBE = $(ISOSPLINE) render out/deccube --size 620x560 --view 58,27
DRAW_STRIPES = $(ISOSPLINE) render out/pictures/dodecahedron --size 560x520 --view -50,40 --stripes 18

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-11s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

build: ## build the release binary, target/release/isospline
	$(CARGO) build --release -p isospline

deccube: build ## convert the decorative cube, check it, write out/deccube/deccube.{glb,vtu}
	$(ISOSPLINE) run configs/deccube.toml
	$(ISOSPLINE) export out/deccube --format glb
	$(ISOSPLINE) export out/deccube --format vtu

paper: build ## convert all models of the paper and print its Table 3 with our figures
	@for model in $(PAPER); do $(ISOSPLINE) run configs/$$model.toml --set target.fit=paper \
		--out out/paper/$$model || exit $$?; done
	$(CARGO) run --release -q -p isospline --example paper_table -- $(PAPER:%=out/paper/%)

test: lint docs unit readers ## format and lint checks, docs, all tests, foreign readers

lint: ## rustfmt and clippy, warnings are errors
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets -- -D warnings

unit:
	@if $(CARGO) nextest --version >/dev/null 2>&1; then \
		$(CARGO) nextest run --workspace --no-fail-fast && $(CARGO) test --workspace --doc -q; \
	else \
		$(CARGO) test --workspace --no-fail-fast; \
	fi

readers: build ## read the exports with OCCT, gmsh, vtk, trimesh, manifold3d, lib3mf and others
	bash tests/readers/run.sh

bench: ## every bench, then each stage's time and ns a patch at 5k, 50k and 500k faces, and what overlaps
	$(CARGO) bench --workspace
	$(CARGO) run --release -q -p isospline --example stage_times
	$(CARGO) run --release -q -p isospline --example overlap

library-bench: build ## convert 1000 models in a batch that is killed in the middle; models a second
	rm -rf out/library-bench
	bash tests/cluster/library.sh $(ISOSPLINE) out/library-bench

cluster: build ## run emitted scripts on Slurm (as root) and snakemake, where they are installed
	rm -rf out/cluster
	bash tests/cluster/slurm.sh $(ISOSPLINE) out/cluster/slurm
	bash tests/cluster/snakemake.sh $(ISOSPLINE) out/cluster/snakemake

bench-peers: build ## the decorative cube to 1e-3 .. 1e-8, beside marching cubes and fidget (needs Python)
	test -x .venv/bin/python || python3 -m venv .venv
	.venv/bin/pip install -q numpy scikit-image
	$(CARGO) build --release -q --manifest-path peers/Cargo.toml --target-dir $(TARGET)/peers
	.venv/bin/python peers/compare.py $(ISOSPLINE) $(TARGET)/peers/release/isospline-peers \
		configs/deccube.toml out/peers

bench-decimate: build ## decimation beside open3d (needs Python and libusb)
	test -x .venv/bin/python || python3 -m venv .venv
	.venv/bin/pip install -q numpy scikit-image open3d
	.venv/bin/python peers/decimate.py $(ISOSPLINE) configs/deccube.toml out/decimate

reliability: ## try what may happen to a run and print the scoreboard (all of it as root)
	$(CARGO) run --release -q -p isospline-tests --bin scoreboard

fuzz: ## run each target of cargo-fuzz for FUZZ_SECONDS (needs cargo-fuzz and a C++ compiler)
	@for target in $(FUZZ_TARGETS); do \
		seeds=; test ! -d tests/fixtures/fuzz/$$target || seeds=tests/fixtures/fuzz/$$target; \
		mkdir -p fuzz/corpus/$$target; \
		$(CARGO) fuzz run --sanitizer none --target-dir $(TARGET)/fuzz $$target \
			fuzz/corpus/$$target $$seeds -- -max_total_time=$(FUZZ_SECONDS) -timeout=10 \
			-rss_limit_mb=1024 || exit $$?; \
	done

fuzz-check: ## check that the targets of cargo-fuzz compile (needs a C++ compiler)
	$(CARGO) check --manifest-path fuzz/Cargo.toml --target-dir $(TARGET)/fuzz

golden: ## rewrite tests/golden; read the diff
	ISOSPLINE_GOLDEN=rewrite $(CARGO) test -p isospline-tests --test golden

pictures: deccube ## draw docs/pictures
	$(ISOSPLINE) run configs/dodecahedron.toml --out out/pictures/dodecahedron \
		--set target.faces=320 --set target.fit=paper
	$(DRAW_CUBE) --stage adapt --style patches -o docs/pictures/deccube_mesh.png
	$(DRAW_CUBE) --style zebra -o docs/pictures/deccube_zebra.png
	$(DRAW_CUBE) --style curvature -o docs/pictures/deccube_curvature.png
	$(DRAW_CUBE) --style gold -o docs/pictures/deccube_gold.png
	$(DRAW_CUBE) --style error -o docs/pictures/deccube_error.png
	$(DRAW_CUBE) --style gaussian -o docs/pictures/deccube_gaussian.png
	$(DRAW_STRIPES) --stage g0_fit -o docs/pictures/dodecahedron_g0.png
	$(DRAW_STRIPES) --stage fairing -o docs/pictures/dodecahedron_g1.png

docs: ## build the API documentation, target/doc/isospline/index.html
	$(CARGO) doc --workspace --no-deps -q

clean: ## remove target, out and the readers' environment
	rm -rf $(TARGET) out .venv
