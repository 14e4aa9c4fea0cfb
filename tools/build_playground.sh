#!/usr/bin/env bash
# The engine as WebAssembly, in target/wasm/carom_playground.wasm; ends with 3 and says so loudly where no toolchain for
# it can be had. Threads, clocks and fused products are not in it: the bits are those of a native build (ADR 16).
set -euo pipefail
cd "$(dirname "$0")/.."
if ! environment=$(bash tools/wasm_toolchain.sh); then
  echo "=== SKIPPED: the playground needs Rust's target wasm32-unknown-unknown, which cannot be had here ===" >&2
  exit 3
fi
eval "$environment"
RUSTFLAGS="-C target-feature=+simd128" cargo build --quiet --locked --profile page --package carom-playground --lib \
  --target wasm32-unknown-unknown --target-dir target/wasm
cp target/wasm/wasm32-unknown-unknown/page/carom_playground.wasm target/wasm/carom_playground.wasm
