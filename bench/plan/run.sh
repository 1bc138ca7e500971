#!/usr/bin/env bash
# Compares the intervals that plans predict with those of fits to their logs, the minutes of
# unplanned driving, and the runs that break a limit, over vehicles drawn at random: run.sh
# [VEHICLES] [FIRST SEED]. With `limits` in front, only counts the runs of vehicles of six axes that
# break a limit: run.sh limits [VEHICLES] [FIRST] [RUNS EACH]
set -euo pipefail
cd "$(dirname "$0")/../.."
if [ "${1:-}" = limits ]; then
    shift
    exec cargo run --quiet --locked -p seaplant-plan --example limits -- "${1:-4}" "${2:-0}" "${3:-250}"
fi
cargo run --quiet --locked -p seaplant-plan --example promises -- "${1:-12}" "${2:-0}"
