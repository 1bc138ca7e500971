"""Writes MAVLink telemetry logs with every message of ardupilotmega, and reads them again with
pymavlink.

python3 make_tlog.py FOLDER
"""

import pathlib
import random
import struct
import sys

import tlog
from expected import Expected
from pymavlink.dialects.v20 import ardupilotmega as dialect

START_S = 1_700_000_000.25
WHOLE = {
    "int8_t": 7,
    "int16_t": 15,
    "int32_t": 31,
    "int64_t": 53,
    "uint8_t": 8,
    "uint16_t": 16,
    "uint32_t": 32,
    "uint64_t": 53,
}


class Writer:
    """A ground station that writes what it receives."""

    def __init__(self):
        self.content = bytearray()
        self.links = {}

    def receive(self, time_s, message, sender=(1, 1), version_1=False, signed=False):
        if sender not in self.links:
            self.links[sender] = dialect.MAVLink(
                None, srcSystem=sender[0], srcComponent=sender[1]
            )
        link = self.links[sender]
        link.signing.secret_key = bytes(range(32)) if signed else None
        link.signing.sign_outgoing = signed
        packed = message.pack(link, force_mavlink1=version_1)
        link.seq = (link.seq + 1) % 256
        self.content += struct.pack(">Q", round(time_s * 1e6)) + packed


def any_of(kind, dice):
    """Returns a message with values of all sizes, sometimes with zeros at its end."""
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths))
    zeros = dice.random() < 0.3

    def number(of):
        if zeros:
            return 0
        if of in ("float", "double"):
            return dice.gauss(0, 1000)
        top = 2 ** WHOLE[of]
        low = -top if of.startswith("i") else 0
        return dice.choice([0, low, top - 1, dice.randrange(low, top)])

    values = []
    for field, of in zip(kind.fieldnames, kind.fieldtypes):
        if of == "char":
            values.append(b"text" if lengths[field] else b"c")
        elif lengths[field]:
            values.append([number(of) for _ in range(lengths[field])])
        else:
            values.append(number(of))
    return kind(*values)


def every_message(log, dice):
    kinds = [kind for number, kind in sorted(dialect.mavlink_map.items()) if number >= 0]
    for round_ in range(4):
        for k, kind in enumerate(kinds):
            if kind.msgname == "PARAM_VALUE":
                continue
            now = START_S + 400 * round_ + k
            version_1 = round_ == 1 and kind.id < 256
            log.receive(now, any_of(kind, dice), version_1=version_1, signed=round_ == 2)


def several_senders(log, dice, rounds):
    for k in range(rounds):
        now = START_S + 0.1 * k
        boot_ms = 5000 + 100 * k
        log.receive(
            now,
            dialect.MAVLink_attitude_message(boot_ms, *(dice.gauss(0, 1) for _ in range(6))),
        )
        for sender in [(1, 1), (255, 190)]:
            log.receive(now, dialect.MAVLink_heartbeat_message(k % 5, 2, 3, 4, 5, 3), sender)
        for name in [b"Lights1", b"CamTilt"]:
            log.receive(now, dialect.MAVLink_named_value_float_message(boot_ms, name, k))
        for battery in range(2):
            log.receive(
                now + 0.01,
                dialect.MAVLink_battery_status_message(
                    battery, 1, 2, 300 + k, [16_000 + k] * 10, -1000 - k, k, 5, 80
                ),
            )
        pulses = [1500 + dice.randrange(-400, 400) for _ in range(8)]
        log.receive(
            now + 0.02, dialect.MAVLink_servo_output_raw_message(boot_ms * 1000, 0, *pulses)
        )
        log.receive(now, dialect.MAVLink_param_value_message(b"FRAME_CONFIG", 2.0, 9, 1, 0))


def stamps(log, expected, dice):
    """Writes messages that arrive late, from a vehicle that is started twice, and with a 32-bit
    counter of microseconds, which overflows after 4295 s."""
    found = {"ATTITUDE.yaw": [], "SERVO_OUTPUT_RAW.servo1_raw": [], "HEARTBEAT.custom_mode": []}
    units = {"ATTITUDE.yaw": "rad", "SERVO_OUTPUT_RAW.servo1_raw": "us"}
    for start, uptime in enumerate([4280.0, 2.0]):
        for k in range(400):
            sent = uptime + 0.1 * k
            now = START_S + 70.0 * start + 0.1 * k
            # The first stamp after a start is not used yet, because it may be an old one.
            unbelieved = start == 1 and k == 0
            # Half of the messages arrive at once.
            late = 0.0 if k % 2 else dice.uniform(0, 0.5)
            boot_ms = round(sent * 1000)
            log.receive(now + late, dialect.MAVLink_attitude_message(boot_ms, 0, 0, k, 0, 0, 0))
            time = now + late if unbelieved else now
            found["ATTITUDE.yaw"].append((time, k))
            if not unbelieved:
                log.receive(
                    now + late,
                    dialect.MAVLink_servo_output_raw_message(
                        boot_ms * 1000 % 2**32, 0, 1000 + k, *[1500] * 7
                    ),
                )
                found["SERVO_OUTPUT_RAW.servo1_raw"].append((now, 1000 + k))
            log.receive(now + late, dialect.MAVLink_heartbeat_message(2, 3, 4, k, 5, 3))
            found["HEARTBEAT.custom_mode"].append((now + late, k))
    for column, samples in found.items():
        times, values = zip(*sorted(samples))
        expected.channel("stamps.tlog", column, times, values, unit=units.get(column))


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)
    dice = random.Random(5)
    for name, make in [
        ("every.tlog", lambda log: every_message(log, dice)),
        ("senders.tlog", lambda log: several_senders(log, dice, 100)),
        ("seed.tlog", lambda log: several_senders(log, dice, 5)),
    ]:
        log = Writer()
        make(log)
        (folder / name).write_bytes(log.content)
        tlog.expect(expected, folder / name, name)
    log = Writer()
    stamps(log, expected, dice)
    (folder / "stamps.tlog").write_bytes(log.content)

    # A message that no public definition has, between two that are known.
    log = Writer()
    for k in range(20):
        log.receive(START_S + k, dialect.MAVLink_heartbeat_message(2, 3, 4, k, 5, 3))
        if k % 4 == 0:
            private = bytes([0xFD, 3, 0, 0, k, 1, 1, 0x39, 0x30, 0]) + b"abc" + b"??"
            log.content += struct.pack(">Q", round((START_S + k) * 1e6)) + private
    (folder / "private.tlog").write_bytes(log.content)
    expected.save()


if __name__ == "__main__":
    main()
