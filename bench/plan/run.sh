#!/usr/bin/env bash
# Compares the intervals that plans predict with those of fits to their logs, the minutes of
# unplanned driving, and the runs that break a limit, over vehicles drawn at random: run.sh
# [VEHICLES] [FIRST SEED]
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo run --quiet --locked -p seaplant-plan --example promises -- "${1:-12}" "${2:-0}"
