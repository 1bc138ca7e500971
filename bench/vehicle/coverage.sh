#!/usr/bin/env bash
# How often the 95 % intervals of six axes hold the truth: coverage.sh [NUMBER] [SEED] [DISTURBANCE ...]
# draws that many vehicles (40) from that seed (0), makes the twin of each, and identifies it.
set -euo pipefail
cd "$(dirname "$0")/../.."
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
python="$(./scripts/python-env)"
cargo build --release --locked --quiet
"$python" bench/vehicle/coverage.py target/release/seaplant "$out" "${1:-40}" "${2:-0}" "${@:3}"
