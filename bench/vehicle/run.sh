#!/usr/bin/env bash
# Peak memory and time of `seaplant identify` on a whole vehicle: the twin of RexROV, driven freely
# for 300 s twice to fit and once held out, in six axes and in three, from logs to the report.
#
# use: run.sh [ROUNDS] [DISTURBANCE...]
set -euo pipefail

rounds=${1:-3}
shift || true
disturbances=""
for name in "$@"; do
    disturbances="$disturbances\"$name\", "
done

bench=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cargo build --quiet --release --locked --manifest-path "$bench/../Cargo.toml"
target=$(cargo metadata --format-version 1 --no-deps --manifest-path "$bench/Cargo.toml" |
    sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
seaplant="$target/release/seaplant"

cat >"$work/spec.toml" <<END
vehicle = "published:rexrov"
duration_s = 300.0
disturbances = [$disturbances]
END
"$seaplant" twin "$work/spec.toml" --out "$work/twin" --quiet
sed 's/^axes = .*/axes = ["surge", "sway", "yaw"]/' "$work/twin/campaign.toml" >"$work/twin/planar.toml"
for round in $(seq "$rounds"); do
    for campaign in campaign planar; do
        /usr/bin/time -f "$campaign, round $round: %U s of processor, %e s, %M KiB" \
            "$seaplant" identify "$work/twin/$campaign.toml" --out "$work/$campaign" --quiet
    done
done
