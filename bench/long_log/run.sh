#!/usr/bin/env bash
# Peak memory and time of `seaplant identify` on a surge trial of 12 channels at 10 Hz, by method.
#
# use: run.sh [HOURS] [METHOD...]
set -euo pipefail

hours=${1:-24}
shift || true
methods=("$@")
if [ ${#methods[@]} -eq 0 ]; then
    methods=(equation-error paper output-error)
fi

bench=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cargo build --quiet --release --manifest-path "$bench/../Cargo.toml" --package seaplant-cli
target=$(cargo metadata --format-version 1 --no-deps --manifest-path "$bench/Cargo.toml" |
    sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
seaplant="$target/release/seaplant"

cat >"$work/spec.toml" <<END
duration_s = $((3600 * hours))
hold_out_s = 480
dofs = ["surge"]
disturbances = ["tether", "lag"]
END
"$seaplant" twin "$work/spec.toml" --out "$work/log" --quiet
for method in "${methods[@]}"; do
    /usr/bin/time -f "$method: %M KiB, %e s" \
        "$seaplant" identify "$work/log/campaign.toml" --method "$method" --out "$work/found" --quiet
done
