#!/usr/bin/env bash
# What plans of trials promise and what fits of their logs obtain, the minutes of unplanned driving, and
# runs that break a limit, over vehicles drawn at random: run.sh [VEHICLES] [FIRST SEED]
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo run --quiet --locked -p seaplant-plan --example promises -- "${1:-12}" "${2:-0}"
