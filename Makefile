# Needs cargo and a shell; on Debian 12 and 13 `make setup` installs the libraries.
.PHONY: gallery install-extras help setup build run install test bench iterations scaling compare docs validate portability lint clean

RANKS ?= 2
DECK  ?= inputs/beam.toml
ARGS  ?=
PREFIX ?= /usr/local
PROGRAM ?= target/release/mpm-par

help:
	@echo "make run       install what is missing, build, run $(DECK) on $(RANKS) ranks"
	@echo "make install   build, and copy mpm-par to $(PREFIX)/bin (PREFIX=...)"
	@echo "make test      all tests"
	@echo "make lint      format, clippy and documentation, warnings are errors"
	@echo "make bench     time the parts of a step beside the machine's limits"
	@echo "make iterations  linear iterations on a curved body: table and figure (long)"
	@echo "make scaling   strong and weak scaling: timed on this machine's cores, counted to 64 ranks"
	@echo "make compare   KratosMPMApplication beside this program, in turn (network, minutes)"
	@echo "make validate  the longer tests: decks with published numbers"
	@echo "make portability  core tests with 64-bit indices and with PETSc's newest release (network, long)"
	@echo "make docs      the code's own documentation, and the book where mdbook is installed"
	@echo "make gallery   a picture of every template, for docs/figures"
	@echo "make install-extras  install, and the manual page and bash completions"
	@echo "make setup     install the Debian packages that are missing"
	@echo "variables: RANKS=$(RANKS) DECK=$(DECK) ARGS='--set analysis.steps=10'"

setup:
	@sh jobs/setup.sh

build: setup
	cargo build --release

# --force: the same command may be given twice.
run: build
	@sh jobs/mpirun.sh $(RANKS) target/release/mpm-par $(DECK) --force $(ARGS)

install: build
	@install -D -m 755 $(PROGRAM) $(DESTDIR)$(PREFIX)/bin/mpm-par
	@echo "installed $(DESTDIR)$(PREFIX)/bin/mpm-par"
	@case ":$$PATH:" in *":$(PREFIX)/bin:"*) ;; \
		*) echo "$(PREFIX)/bin is not on the PATH: export PATH=$(PREFIX)/bin:\$$PATH" ;; esac

# Most tests wait for ranks to come and go: more of them than cores.
test: setup
	RUST_TEST_THREADS=$${RUST_TEST_THREADS:-$$((2 * $$(nproc) + 4))} cargo test --release

bench: setup
	cargo bench --bench kernels
	cargo bench --bench runs
	cargo bench --bench explicit

# Writes docs/figures/iterations.csv and .svg.
iterations: setup
	cargo bench --bench iterations

# Writes docs/figures/scaling-*.csv and .svg; jobs/scaling.py has the parts.
scaling: build
	python3 jobs/scaling.py all

# Installs KratosMPMApplication from PyPI in target/compare/venv; prints the table of docs/evidence/compare.md.
compare: build
	python3 jobs/compare.py

# Every deck with a published number, the long ones too; rewrites the tables of docs/validation*.md.
validate: setup
	MPM_PAR_VALIDATION=1 cargo test --release --no-fail-fast -- --include-ignored

# Nothing is installed: packages are unpacked and built in target/portability. WITH=mpich: that one.
portability: setup
	bash jobs/portability.sh $(WITH)

# The book needs mdbook (cargo install mdbook); without it only the code's documentation is made.
docs: setup
	cargo doc --no-deps --document-private-items
	@if command -v mdbook >/dev/null; then mdbook build docs; else echo "no mdbook: target/book is not made"; fi

# The picture of every template, by the program itself.
gallery: build
	bash jobs/gallery.sh

# Shell completions and the manual page below PREFIX.
install-extras: install
	@install -d $(DESTDIR)$(PREFIX)/share/man/man1 $(DESTDIR)$(PREFIX)/share/bash-completion/completions
	@$(PROGRAM) man > $(DESTDIR)$(PREFIX)/share/man/man1/mpm-par.1
	@$(PROGRAM) completions bash > $(DESTDIR)$(PREFIX)/share/bash-completion/completions/mpm-par
	@echo "installed the manual page and bash completions"

lint:
	cargo fmt --check
	cargo clippy --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --document-private-items

clean:
	cargo clean
