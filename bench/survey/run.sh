#!/usr/bin/env bash
# Times `seaplant inspect` of large logs, and reading CSV and bags, compared with Python's
# readers.
set -euo pipefail

megabytes=${1:-1000}
rounds=${2:-3}

here=$(cd "$(dirname "$0")" && pwd)
bench=$(dirname "$here")
python=$("$bench/../scripts/python-env")
others=${BENCH_PYTHON:-$python}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export POLARS_MAX_THREADS=1

cargo build --quiet --release --manifest-path "$bench/Cargo.toml" --bin read_log
cargo build --quiet --release --manifest-path "$bench/../crates/seaplant-cli/Cargo.toml"
target=$(cargo metadata --format-version 1 --no-deps --manifest-path "$bench/Cargo.toml" |
    "$python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')

# One line: the file, the elapsed time, and the processor time in it.
timed() {
    local name=$1
    shift
    TIMEFORMAT='elapsed_s %R user_s %U system_s %S'
    printf '%s: %s\n' "$name" "$({ time "$@"; } 2>&1 | tr '\n' ' ')"
}

"$python" -B "$here/make.py" "$work" "$megabytes"
for log in log.csv log.BIN log.tlog log.mcap log.db3 log.bag log.parquet; do
    printf '\n%s: %s bytes\n' "$log" "$(stat --format %s "$work/$log")"
    for _ in $(seq "$rounds"); do
        timed "inspect" "$target/release/seaplant" inspect "$work/$log" --quiet
        timed "inspect --whole" "$target/release/seaplant" inspect "$work/$log" --whole --quiet
    done
    rm "$work/$log"
done

"$python" -B "$here/make.py" "$work" $((megabytes / 5)) log.csv log.db3 log.bag
for _ in $(seq "$rounds"); do
    timed "CSV, Seaplant" "$target/release/read_log" "$work/log.csv"
    for tool in pandas pyarrow polars; do
        if "$others" -c "import $tool" 2> /dev/null; then
            timed "CSV, $tool" "$others" -B "$here/read_others.py" "$tool" "$work/log.csv"
        fi
    done
    timed "CSV, memory" "$python" -B "$here/read_others.py" memory "$work/log.csv"
    for log in log.db3 log.bag; do
        timed "$log, Seaplant" "$target/release/read_log" "$work/$log"
        timed "$log, rosbags" "$python" -B "$here/read_others.py" rosbags "$work/$log"
    done
done
