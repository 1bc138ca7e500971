#!/usr/bin/env bash
# Times the reading of a DataFlash log and of a MAVLink telemetry log beside pymavlink.
#
# use: run.sh [MEGABYTES] [ROUNDS]
#
# pymavlink reads each log once, for it takes minutes.
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

# One line: what was read, how long it took, and how much of that a processor worked.
timed() {
    local name=$1
    shift
    TIMEFORMAT='user_s %U system_s %S'
    printf '%s: %s\n' "$name" "$({ time "$@"; } 2>&1 | tr '\n' ' ')"
}

for log in log.BIN log.tlog; do
    printf '\n%s: %s bytes\n' "$log" "$(stat --format %s "$work/$log")"
    timed pymavlink "$python" -B "$here/read_log.py" "$work/$log"
    for _ in $(seq "$rounds"); do
        timed seaplant "$rust" "$work/$log"
    done
done
