# `just` lists the commands; each is what README and CI use.

_list:
    @just --list --unsorted

# The marked road, end to end, into ./catseye-demo
demo *options:
    cargo run --release -- demo {{ options }}

# All tests; installs the software Vulkan driver where it is missing
test *options:
    scripts/test {{ options }}

# Format
fmt:
    cargo fmt --all

# Lints, as in CI
lint:
    cargo fmt --all --check
    cargo clippy --workspace --release --locked --features "$(scripts/features)" --all-targets -- -D warnings
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --release --locked --features "$(scripts/features)" --no-deps --exclude catseye-python

# Everything that CI checks
ci:
    bash .ci/run

# Licences and sources of the dependencies (needs cargo-deny)
deny:
    cargo deny check licenses bans sources

# Adapters, and which one `auto` takes
devices:
    cargo run --release -- devices

# The manual, in the browser (needs mdbook)
book:
    mdbook serve --open

# API documentation of all crates
doc:
    cargo doc --release --no-deps --workspace --exclude catseye-python --open

# Tables of keys in docs/reference from the schemas
keys:
    scripts/reference-pages
