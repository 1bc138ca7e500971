#!/usr/bin/env bash
# Times output error of one trial, compared with SciPy, numba, CasADi and JAX, in turn, in one
# run.
set -euo pipefail

samples=${1:-6001}
rounds=${2:-5}

here=$(cd "$(dirname "$0")" && pwd)
bench=$(dirname "$here")
venv="$bench/.venv-output-error"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [ ! -x "$venv/bin/python" ]; then
    python3 -m venv "$venv"
fi
"$venv/bin/pip" install --quiet numpy==2.4.6 scipy==1.17.1 numba==0.68.1 casadi==3.8.2 jax==0.10.2

cargo build --quiet --release --manifest-path "$bench/Cargo.toml" --bin output_error
target=$(cargo metadata --format-version 1 --no-deps --manifest-path "$bench/Cargo.toml" |
    "$venv/bin/python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
rust="$target/release/output_error"

# One core each, so that one thread is compared with one.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
export XLA_FLAGS="--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
"$rust" make "$work/surge.f64" "$samples"
for round in $(seq "$rounds"); do
    "$rust" time "$work/surge.f64" 50 >"$work/rust.$round"
    for tool in numba:50 jax:20 casadi:20 scipy:3; do
        "$venv/bin/python" "$here/output_error.py" "${tool%:*}" "$work/surge.f64" "${tool#*:}" \
            >"$work/${tool%:*}.$round"
    done
done
"$venv/bin/python" "$here/table.py" "$work" "$samples" "$rounds"
