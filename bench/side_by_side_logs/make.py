"""Writes a DataFlash log and a MAVLink telemetry log of about 200 MB each.

    make.py FOLDER [MEGABYTES]

A block of records is written once, by pymavlink's tables of types and its packer of messages; it is
repeated with times that go on. The values repeat too, which neither reader can make use of.
"""

import pathlib
import random
import sys

import numpy

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parent.parent / "crates/seaplant-log/tests/reference"))

import dataflash
from make_tlog import Writer as Telemetry
from pymavlink.dialects.v20 import ardupilotmega as dialect

STEP_US = 100_000
"""A block has ROUNDS rounds of messages, STEP_US apart."""
ROUNDS = 2000


def repeat(block, places, kind, times, megabytes, path):
    """Writes a block repeatedly; `times` are at `places` in it, and advance."""
    block = numpy.frombuffer(bytes(block), numpy.uint8).copy()
    places = numpy.array(places)[:, None] + numpy.arange(8)
    times = numpy.array(times, numpy.int64)
    with open(path, "ab") as file:
        for k in range(max(1, round(megabytes * 1e6 / len(block)))):
            now = (times + k * ROUNDS * STEP_US).astype(kind)
            block[places] = now.view(numpy.uint8).reshape(-1, 8)
            file.write(block.tobytes())


def telemetry(path, megabytes):
    dice = random.Random(2)
    log, places, times = Telemetry(), [], []
    numbers = lambda count: [dice.gauss(0, 1) for _ in range(count)]
    for k in range(ROUNDS):
        boot = 5000 + k * STEP_US // 1000
        for message in [
            dialect.MAVLink_attitude_message(boot, *numbers(6)),
            dialect.MAVLink_ahrs2_message(*numbers(4), 473_000_000, 85_000_000),
            dialect.MAVLink_vfr_hud_message(*numbers(2), 90, 50, *numbers(2)),
            dialect.MAVLink_local_position_ned_message(boot, *numbers(6)),
            dialect.MAVLink_servo_output_raw_message(
                boot * 1000, 0, *(1500 + k % 300 for _ in range(8))
            ),
            dialect.MAVLink_raw_imu_message(
                boot * 1000, *(dice.randrange(-1000, 1000) for _ in range(9))
            ),
            dialect.MAVLink_scaled_pressure_message(boot, *numbers(2), 2000),
            dialect.MAVLink_battery_status_message(
                0, 1, 2, 300, [16_000 + k % 99] * 10, -1000, k, 5, 80
            ),
        ]:
            places.append(len(log.content))
            times.append(1_700_000_000_000_000 + k * STEP_US)
            log.receive(0, message)
    path.write_bytes(b"")
    repeat(log.content, places, ">i8", times, megabytes, path)


def flash(path, megabytes):
    dice = random.Random(3)
    log, places, times = dataflash.Writer(), [], []
    log.letters(
        {
            "s": "s",
            "d": "deg",
            "E": "rad/s",
            "o": "m/s/s",
            "m": "m",
            "n": "m/s",
            "Y": "us",
            "#": "instance",
            "-": "",
        },
        {"-": 0, "F": 1e-6, "0": 1, "B": 0.01},
    )
    log.define(
        1,
        "IMU",
        "QBffffffIIfBBHH",
        "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
    )
    log.define(
        2,
        "ATT",
        "QccccCCCCB",
        "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF",
    )
    log.define(
        3, "RCOU", "QHHHHHHHHHHHHHH", "TimeUS," + ",".join(f"C{k}" for k in range(1, 15))
    )
    log.define(
        4,
        "XKF1",
        "QBccCfffffffccce",
        "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH",
    )
    log.define(5, "BARO", "QBffcfIffB", "TimeUS,I,Alt,Press,Temp,CRt,SMS,Offset,GndTemp,Health")
    log.record(132, 0, 1, "s#EEEooo--O--zz", "F-000000-----00")
    log.record(132, 0, 2, "sddddhhdh-", "FBBBBBBBB-")
    log.record(132, 0, 3, "s" + 14 * "Y", "F" + 14 * "-")
    log.record(132, 0, 4, "s#ddhnnnnmmmkkkm", "F-BBB0000000BBBB")
    log.record(132, 0, 5, "s#mPOnsmO-", "F-00B0C?0-")
    path.write_bytes(log.content)
    log.content.clear()
    numbers = lambda count: [dice.gauss(0, 1) for _ in range(count)]
    whole = lambda count: [dice.randrange(0, 30_000) for _ in range(count)]
    for k in range(ROUNDS):
        for number, values in [
            *((1, [i, *numbers(6), 0, 0, 30.0, 1, 1, 1000, 1000]) for i in (0, 1, 0, 1)),
            (2, [*whole(8), 3]),
            (3, [1500 + k % 300] * 14),
            (4, [0, *whole(3), *numbers(7), *whole(4)]),
            (5, [k % 2, *numbers(2), 2000, 0.0, 0, 0.0, 20.0, 1]),
        ]:
            places.append(len(log.content) + 3)
            times.append(1_000_000 + k * STEP_US)
            log.record(number, 0, *values)
            # Two of a kind follow each other by a millisecond.
            times[-1] += 1000 * (len(times) % 8)
    repeat(log.content, places, "<i8", times, megabytes, path)


def main():
    folder = pathlib.Path(sys.argv[1])
    megabytes = float(sys.argv[2]) if len(sys.argv) > 2 else 210
    flash(folder / "log.BIN", megabytes)
    telemetry(folder / "log.tlog", megabytes)


if __name__ == "__main__":
    main()
