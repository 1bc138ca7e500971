"""Writes the twin's heave and yaw trials as ArduSub would log them, with its names.

    python3 twin_to_ardusub.py FOLDER_OF_THE_DEMO FOLDER

Depth is a height, thrusters are pulse widths: 1500 us and SCALE us for a rad/s. Writes vehicle.toml,
too, as a person would finish it who knows the vehicle: motors in the order of the outputs.
"""

import csv
import math
import pathlib
import sys

import tomllib

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parent.parent.parent / "seaplant-log/tests/reference"))

import dataflash

SCALE = 2.0


def rows_of(table):
    with open(table, newline="") as file:
        header, *rows = csv.reader(file)
    return header[1:], [[float(cell) for cell in row] for row in rows]


def write(trial, path):
    """Writes the trial's tables as one log, with the thrusters in the order of the outputs."""
    thrusters, speeds = rows_of(trial / "thrusters.csv")
    attitude, angles = rows_of(trial / "attitude.csv")
    order = [attitude.index(f"{angle} [deg]") for angle in ("roll", "pitch", "heading")]
    _, depths = rows_of(trial / "depth.csv")
    log = dataflash.Writer()
    outputs = ",".join(f"C{k + 1}" for k in range(len(thrusters)))
    log.define(10, "RCOU", "Q" + "d" * len(thrusters), "TimeUS," + outputs)
    log.define(11, "ATT", "Qddd", "TimeUS,Roll,Pitch,Yaw")
    log.define(12, "BARO", "Qd", "TimeUS,Alt")
    pulse = lambda rpm: 1500.0 + SCALE * rpm * math.pi / 30
    records = [(row[0], 10, [pulse(rpm) for rpm in row[1:]]) for row in speeds]
    records += [(row[0], 11, [row[1 + k] for k in order]) for row in angles]
    records += [(row[0], 12, [-row[1]]) for row in depths]
    for time, number, values in sorted(records):
        log.record(number, round(time * 1e6), *values)
    path.write_bytes(log.content)
    return [name.split(" [")[0] for name in thrusters]


def main():
    demo, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    for trial in ["heave-1", "heave-hold-out", "yaw-1", "yaw-hold-out"]:
        order = write(demo / "logs" / trial, folder / f"{trial}.BIN")
    vehicle = tomllib.loads((demo / "vehicle.toml").read_text())
    lines = [f'name = "{vehicle["name"]}"', f"dry_mass_kg = {vehicle['dry_mass_kg']}"]
    lines.append(f"size_m = {vehicle['size_m']}")
    for thruster in vehicle["thruster"]:
        curve = thruster["curve"]
        forward, reverse = (curve[way] / SCALE**2 for way in ("forward", "reverse"))
        lines += ["[[thruster]]", f'name = "motor {order.index(thruster["name"]) + 1}"']
        lines += [
            f"position_m = {thruster['position_m']}",
            f"direction = {thruster['direction']}",
        ]
        lines.append(
            f'curve = {{ kind = "quadratic", input = "pwm", forward = {forward}, reverse = {reverse} }}'
        )
    for name, sensor in vehicle.get("sensor", {}).items():
        if name != "dvl":
            lines.append(f"[sensor.{name}]")
            lines += [f"{key} = {value}" for key, value in sensor.items()]
    (folder / "finished.toml").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
