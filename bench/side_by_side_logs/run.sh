#!/usr/bin/env bash
# Times reading a DataFlash log and a MAVLink telemetry log, compared with pymavlink.
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

# One line: the file, the elapsed time, and the processor time in it.
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
