#!/usr/bin/env bash
# Measures plants of six axes on vehicles of another simulator: run.sh [NUMBER] [SEED] [FAULT
# ...] draws that many (30) from that seed (0), with one to three faults each or with the named
# ones, identifies each, and counts errors, intervals and verdicts. OUT=folder keeps the logs,
# and judges those that exist.
set -euo pipefail
cd "$(dirname "$0")/../.."
number="${1:-30}"
seed="${2:-0}"
if [ -n "${OUT:-}" ]; then
    out="$OUT"
else
    out="$(mktemp -d)"
    trap 'rm -rf "$out"' EXIT
fi
python="$(./scripts/python-env)"
cargo build --release --locked --quiet
[ -e "$out" ] && [ -n "$(ls -A "$out")" ] ||
    "$python" bench/strangers/draw.py "$out" "$number" "$seed" "${@:3}"
"$python" bench/strangers/judge.py target/release/seaplant "$out"
