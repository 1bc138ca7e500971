#!/usr/bin/env bash
# Times reading a large MCAP file into all its channels, compared with mcap-ros2-support, which
# decodes every message and keeps none.
set -euo pipefail

megabytes=${1:-200}
rounds=${2:-5}

here=$(cd "$(dirname "$0")" && pwd)
bench=$(dirname "$here")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python=$("$bench/../scripts/python-env")

cargo build --quiet --release --manifest-path "$bench/Cargo.toml" --bin read_log
target=$(cargo metadata --format-version 1 --no-deps --manifest-path "$bench/Cargo.toml" |
    "$python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')

"$python" -B "$here/read_mcap.py" make "$work/log.mcap" "$megabytes"
echo "bytes $(stat --format %s "$work/log.mcap")"
for _ in $(seq "$rounds"); do
    echo "Seaplant: $("$target/release/read_log" "$work/log.mcap" | tr '\n' ' ')"
done
echo "mcap-ros2-support: $("$python" -B "$here/read_mcap.py" read "$work/log.mcap" | tr '\n' ' ')"
for _ in $(seq "$rounds"); do
    echo "Seaplant: $("$target/release/read_log" "$work/log.mcap" | tr '\n' ' ')"
done
