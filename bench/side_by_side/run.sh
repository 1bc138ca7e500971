#!/usr/bin/env bash
# Times equation error of ten million samples, compared with NumPy and SciPy, in pairs.
set -euo pipefail

samples=${1:-10000000}
pairs=${2:-9}

here=$(cd "$(dirname "$0")" && pwd)
bench=$(dirname "$here")
venv="$bench/.venv"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [ ! -x "$venv/bin/python" ]; then
    python3 -m venv "$venv"
fi
"$venv/bin/pip" install --quiet numpy==2.4.6 scipy==1.17.1

cargo build --quiet --release --manifest-path "$bench/Cargo.toml" --bin equation_error
target=$(cargo metadata --format-version 1 --no-deps --manifest-path "$bench/Cargo.toml" |
    "$venv/bin/python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
rust="$target/release/equation_error"

"$rust" make "$work/surge.f64" "$samples"
for pair in $(seq "$pairs"); do
    "$rust" time "$work/surge.f64" >"$work/rust.$pair"
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        "$venv/bin/python" "$here/equation_error.py" "$work/surge.f64" >"$work/numpy.$pair"
    "$venv/bin/python" "$here/equation_error.py" "$work/surge.f64" >"$work/threads.$pair"
done
"$venv/bin/python" "$here/table.py" "$work" "$samples" "$pairs"
