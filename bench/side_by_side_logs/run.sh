#!/usr/bin/env bash
# Times the reading of a DataFlash log and of a MAVLink telemetry log beside pymavlink.
#
# use: run.sh [MEGABYTES] [ROUNDS]
#
# pymavlink reads each log once, between Seaplant's rounds: it takes minutes.
set -euo pipefail

megabytes=${1:-210}
rounds=${2:-5}

here=$(cd "$(dirname "$0")" && pwd)
bench=$(dirname "$here")
python=$("$bench/../scripts/python-env")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cargo build --quiet --release --manifest-path "$bench/Cargo.toml" --bin read_log
target=$(cargo metadata --format-version 1 --no-deps --manifest-path "$bench/Cargo.toml" |
    "$python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
rust="$target/release/read_log"

"$python" -B "$here/make.py" "$work" "$megabytes"
for log in log.BIN log.tlog; do
    printf '\n%s: %s bytes\n' "$log" "$(stat --format %s "$work/$log")"
    for round in $(seq "$rounds"); do
        printf 'seaplant %s\n' "$("$rust" "$work/$log" | tr '\n' ' ')"
        if [ "$round" = 1 ]; then
            printf 'pymavlink %s\n' "$("$python" -B "$here/read_log.py" "$work/$log" | tr '\n' ' ')"
        fi
    done
done
