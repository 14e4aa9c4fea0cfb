#!/usr/bin/env bash
# A Rust toolchain for WebAssembly. Prints the environment to build with, as shell assignments; ends with 1 and says so
# where there is none. First rustup's target; where rustup cannot reach its server (or is not there), Debian's packages
# of rustc and of the sources of std, unpacked into a folder of their own without root, std built from them once.
#   usage: eval "$(tools/wasm_toolchain.sh [FOLDER])"
set -euo pipefail
TARGET=wasm32-unknown-unknown
FOLDER=$(realpath -m "${1:-target/wasm-toolchain}")

has_std() { ls "$1"/lib/rustlib/$TARGET/lib/libstd-*.rlib >/dev/null 2>&1; }

if has_std "$(rustc --print sysroot)"; then
  exit 0
fi
if command -v rustup >/dev/null && timeout 120 rustup target add $TARGET >&2 2>/dev/null && has_std "$(rustc --print sysroot)"; then
  exit 0
fi
if [ -f "$FOLDER/env.sh" ]; then
  cat "$FOLDER/env.sh"
  exit 0
fi
give_up() { echo "wasm_toolchain: $1" >&2; exit 1; }
command -v apt-get >/dev/null && command -v dpkg >/dev/null || give_up "no rustup target and no Debian packages here"
LINKER=$(find "$(rustc --print sysroot)/lib/rustlib" -name rust-lld -type f 2>/dev/null | head -1)
[ -n "$LINKER" ] || LINKER=$(command -v wasm-ld || true)
[ -n "$LINKER" ] || give_up "no linker for WebAssembly (rust-lld or wasm-ld)"
candidate() { apt-cache policy "$1" 2>/dev/null | awk '/Candidate/ && $2 != "(none)" { print $2 }'; }
dependency() { apt-cache depends "$1" 2>/dev/null | awk -v wanted="$2" '$1 ~ /Depends/ && $2 ~ wanted { print $2; exit }'; }
VERSION=$(candidate rust-web-src)
[ -n "$VERSION" ] || give_up "no package rust-web-src (run apt-get update as root)"
STD=$(dependency "libstd-rust-web-dev=$VERSION" '^libstd-rust-web-')
LLVM=$(dependency "$STD=$VERSION" '^libllvm')
mkdir -p "$FOLDER/packages"
(cd "$FOLDER/packages" && apt-get download -qq -o APT::Sandbox::User=root "rustc-web=$VERSION" \
  "libstd-rust-web-dev=$VERSION" "$STD=$VERSION" "rust-web-src=$VERSION" "$LLVM" >&2) || give_up "packages could not be downloaded"
for package in "$FOLDER"/packages/{rustc-web_,libstd-rust-web,libllvm}*.deb; do dpkg -x "$package" "$FOLDER"; done
# of the sources only std's
dpkg --fsys-tarfile "$FOLDER"/packages/rust-web-src_*.deb | tar -x -C "$FOLDER" --wildcards './usr/src/rustc-*/library/*' ./usr/lib/rustlib/src
rm -rf "$FOLDER/packages"
export RUSTC="$FOLDER/usr/bin/rustc" LD_LIBRARY_PATH="$FOLDER/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH 2>/dev/null || echo x86_64-linux-gnu)"
WORK=$(mktemp -d)
trap 'rm -rf "$WORK"' EXIT
mkdir "$WORK/src"
echo '#![no_std]' >"$WORK/src/lib.rs"
printf '[package]\nname = "empty"\nversion = "0.0.0"\nedition = "2021"\n[profile.release]\ncodegen-units = 1\n' >"$WORK/Cargo.toml"
(cd "$WORK" && CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$LINKER" RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Cembed-bitcode=yes" \
  cargo build -q --release -Z build-std=std,panic_abort --target $TARGET --target-dir "$WORK/target" >&2) || give_up "std could not be built"
LIBRARIES="$FOLDER/usr/lib/rustlib/$TARGET/lib"
mkdir -p "$LIBRARIES"
cp "$WORK"/target/$TARGET/release/deps/lib*.rlib "$LIBRARIES/"
rm -f "$LIBRARIES"/libempty-*.rlib
printf 'export RUSTC=%q LD_LIBRARY_PATH=%q CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=%q\n' "$RUSTC" "$LD_LIBRARY_PATH" "$LINKER" >"$FOLDER/env.sh"
cat "$FOLDER/env.sh"
