#!/usr/bin/env bash
# The source distribution of the Python package, and one wheel per target from the sources in it (stable ABI: each serves
# Python 3.9 and later). Wheels for Linux are linked by zig against glibc 2.17 (manylinux2014), for other architectures also.
# usage: python/build_wheels.sh OUT_DIR [TARGET...]     [default: x86_64- and aarch64-unknown-linux-gnu]
# Needs Rust with these targets (`rustup target add`), Python and PyPI.
set -euo pipefail
mkdir -p "${1:?usage: python/build_wheels.sh OUT_DIR [TARGET...]}"
out=$(cd "$1" && pwd)
shift
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || targets=(x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu)
cd "$(dirname "$0")/.."
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/venv"
export PATH="$work/venv/bin:$work/venv/Scripts:$PATH"
pip install -q -r python/requirements-build.txt

rm -f "$out"/romc-*.whl "$out"/romc-*.tar.gz
maturin sdist --manifest-path python/Cargo.toml --out "$out"
sources=$CARGO_TARGET_DIR/sdist
rm -rf "$sources" && mkdir -p "$sources"
tar -xzmf "$out"/romc-*.tar.gz -C "$sources" --strip-components 1 # -m: cargo compares times of files
for target in "${targets[@]}"; do
  options=()
  case $target in *-linux-gnu) options=(--zig --compatibility manylinux2014) ;; esac
  (cd "$sources" && maturin build --locked --target "$target" ${options[@]+"${options[@]}"} --out "$out")
done

twine check --strict "$out"/romc-*
for wheel in "$out"/romc-*linux*.whl; do
  [ -f "$wheel" ] || continue
  auditwheel show "$wheel" | tee "$work/audit"
  # The quoted tag is the oldest that the symbols of the wheel allow; it may be manylinux_2_28 at most.
  minor=$(sed -n 's/.*"manylinux_2_\([0-9]*\)_.*".*/\1/p' "$work/audit" | head -n 1)
  [ "${minor:-99}" -le 28 ] || { echo "$wheel: needs a newer glibc than 2.28" >&2; exit 1; }
done
