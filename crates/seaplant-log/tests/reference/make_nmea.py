"""Writes logs of NMEA 0183 sentences, and decodes them by pynmea2 where it knows the sentence.

python3 make_nmea.py FOLDER
"""

import calendar
import datetime
import pathlib
import random
import sys

import pynmea2
from expected import Expected

DICE = random.Random(11)
START = calendar.timegm((2031, 12, 31, 23, 59, 40))


def number(low, high, digits):
    return f"{DICE.uniform(low, high):.{digits}f}"


def signed(value, letter):
    return -float(value) if letter in "WSPB" else float(value)


def position():
    lat, lon = (
        f"{DICE.randrange(90):02d}{number(0, 59.9, 7):0>10}",
        f"{DICE.randrange(180):03d}{number(0, 59.9, 7):0>10}",
    )
    return lat, DICE.choice("NS"), lon, DICE.choice("EW")


def utc(time_s):
    moment = datetime.datetime.fromtimestamp(time_s, datetime.timezone.utc)
    return moment, moment.strftime("%H%M%S.%f")[:9]


def standard(kind, time_s):
    """Returns a sentence and its channels as (name, unit, value), by pynmea2's parser."""
    moment, clock = utc(time_s)
    lat, north, lon, east = position()
    head, magnetic = number(0, 359.9, 2), number(0, 359.9, 2)
    side = DICE.choice("EW")
    talker, fields = {
        "HDT": ("HE", [head, "T"]),
        "HDM": ("HC", [magnetic, "M"]),
        "HDG": ("HC", [magnetic, number(0, 5, 1), side, number(0, 20, 1), side]),
        "ROT": ("HE", [number(-60, 60, 1), DICE.choice("AAAV")]),
        "DPT": ("SD", [number(1, 90, 2), number(-2, 2, 1)]),
        "DBT": ("SD", [number(1, 90, 1), "f", number(1, 30, 2), "M", number(1, 9, 1), "F"]),
        "VTG": (
            "GP",
            [head, "T", magnetic, "M", number(0, 9, 2), "N", number(0, 9, 2), "K", "A"],
        ),
        "VBW": (
            "VD",
            [
                number(-3, 3, 2),
                number(-3, 3, 2),
                DICE.choice("AV"),
                number(-3, 3, 2),
                number(-3, 3, 2),
                DICE.choice("AV"),
            ],
        ),
        "VHW": ("VW", [head, "T", magnetic, "M", number(0, 9, 2), "N", number(0, 9, 2), "K"]),
        "VLW": ("VW", [number(0, 900, 2), "N", number(0, 90, 2), "N"]),
        "GGA": (
            "GN",
            [
                clock,
                lat,
                north,
                lon,
                east,
                DICE.choice("0145"),
                "11",
                "0.8",
                number(-5, 50, 3),
                "M",
                "-20.1",
                "M",
                "",
                "",
            ],
        ),
        "GLL": ("GN", [lat, north, lon, east, clock, DICE.choice("AAV"), "A"]),
        "RMC": (
            "GN",
            [
                clock,
                DICE.choice("AAV"),
                lat,
                north,
                lon,
                east,
                number(0, 9, 2),
                head,
                moment.strftime("%d%m%y"),
                number(0, 20, 1),
                side,
                "A",
            ],
        ),
        "ZDA": (
            "GP",
            [clock, moment.strftime("%d"), moment.strftime("%m"), str(moment.year), "00", "00"],
        ),
    }[kind]
    text = str(pynmea2.NMEASentence.parse(f"${talker}{kind}," + ",".join(fields)).render())
    got = pynmea2.parse(text, check=True)
    values = {
        "HDT": lambda: [("heading", "deg", got.heading)],
        "HDM": lambda: [("heading_magnetic", "deg", got.heading)],
        "HDG": lambda: [
            ("heading_magnetic", "deg", got.heading),
            ("deviation", "deg", signed(got.deviation, got.dev_dir)),
            ("variation", "deg", signed(got.variation, got.var_dir)),
        ],
        "ROT": lambda: [
            ("rate_of_turn", "deg/s", got.status == "A" and float(got.rate_of_turn) / 60)
        ],
        "DPT": lambda: [("depth", "m", got.depth), ("offset", "m", got.offset)],
        "DBT": lambda: [("depth", "m", got.depth_meters)],
        "VTG": lambda: [
            ("course", "deg", got.true_track),
            ("course_magnetic", "deg", got.mag_track),
            ("speed", "kn", got.spd_over_grnd_kts),
        ],
        "VBW": lambda: [
            (f"{of}_speed_{to}", "kn", valid == "A" and speed)
            for of, to, valid, speed in [
                ("water", "forward", got.data_validity_water_spd, got.lon_water_spd),
                ("water", "starboard", got.data_validity_water_spd, got.trans_water_spd),
                ("ground", "forward", got.data_validity_grnd_spd, got.lon_grnd_spd),
                ("ground", "starboard", got.data_validity_grnd_spd, got.trans_grnd_spd),
            ]
        ],
        "VHW": lambda: [
            ("heading", "deg", got.heading_true),
            ("heading_magnetic", "deg", got.heading_magnetic),
            ("water_speed", "kn", got.water_speed_knots),
        ],
        "VLW": lambda: [
            ("water_distance", "nmi", got.trip_distance),
            ("water_trip", "nmi", got.trip_distance_reset),
        ],
        "GGA": lambda: [
            ("latitude", "deg", got.gps_qual and got.latitude),
            ("longitude", "deg", got.gps_qual and got.longitude),
            ("altitude", "m", got.gps_qual and got.altitude),
            ("quality", None, str(got.gps_qual)),
            ("satellites", None, got.num_sats),
            ("hdop", None, got.horizontal_dil),
        ],
        "GLL": lambda: [
            ("latitude", "deg", got.status == "A" and got.latitude),
            ("longitude", "deg", got.status == "A" and got.longitude),
        ],
        "RMC": lambda: [
            (name, unit, got.status == "A" and value)
            for name, unit, value in [
                ("latitude", "deg", got.latitude),
                ("longitude", "deg", got.longitude),
                ("speed", "kn", got.spd_over_grnd),
                ("course", "deg", got.true_course),
                ("variation", "deg", signed(got.mag_variation, got.mag_var_dir)),
            ]
        ],
        "ZDA": lambda: [],
    }[kind]()
    return text, [(f"{talker}-{kind}.{name}", unit, value) for name, unit, value in values]


def checked(body):
    return f"${body}*{pynmea2.NMEASentence.checksum(body):02X}"


def own(kind, time_s):
    """Returns proprietary sentences, which pynmea2 does not know."""
    a, b, c, d = number(0, 359, 2), number(-9, 9, 3), number(-9, 9, 3), number(-1, 1, 2)
    _, clock = utc(time_s)
    body, values = {
        "THS": (f"HETHS,{a},A", [("HE-THS.heading", "deg", a)]),
        "PASHR": (
            f"PASHR,{clock},{a},T,{b},{c},{d},0.010,0.011,0.020,1,1",
            [
                ("PASHR.heading", "deg", a),
                ("PASHR.roll", "deg", b),
                ("PASHR.pitch", "deg", c),
                ("PASHR.heave", "m", d),
                ("PASHR.roll_std", "deg", 0.010),
                ("PASHR.pitch_std", "deg", 0.011),
                ("PASHR.heading_std", "deg", 0.020),
            ],
        ),
        "PRDID": (
            f"PRDID,{b},{c},{a}",
            [("PRDID.pitch", "deg", b), ("PRDID.roll", "deg", c), ("PRDID.heading", "deg", a)],
        ),
        "ATITUD": (
            f"PIXSE,ATITUD,{b},{c}",
            [("PIXSE-ATITUD.roll", "deg", b), ("PIXSE-ATITUD.pitch", "deg", c)],
        ),
        "POSITI": (
            f"PIXSE,POSITI,{b},{a},{c}",
            [
                ("PIXSE-POSITI.latitude", "deg", b),
                ("PIXSE-POSITI.longitude", "deg", a),
                ("PIXSE-POSITI.altitude", "m", c),
            ],
        ),
        "SPEED_": (
            f"PIXSE,SPEED_,{b},{c},{d}",
            [
                ("PIXSE-SPEED_.speed_east", "m/s", b),
                ("PIXSE-SPEED_.speed_north", "m/s", c),
                ("PIXSE-SPEED_.speed_up", "m/s", d),
            ],
        ),
    }[kind]
    return checked(body), values


STANDARD = [
    "HDT",
    "HDM",
    "HDG",
    "ROT",
    "DPT",
    "DBT",
    "VTG",
    "VBW",
    "VHW",
    "VLW",
    "GGA",
    "GLL",
    "RMC",
    "ZDA",
]
OWN = ["THS", "PASHR", "PRDID", "ATITUD", "POSITI", "SPEED_"]


class Columns:
    def __init__(self):
        self.columns = {}

    def put(self, time_s, values):
        for column, unit, value in values:
            times, held, _ = self.columns.setdefault(column, ([], [], unit))
            times.append(time_s)
            held.append(
                None
                if value is None or value is False or (value == 0 and isinstance(value, int))
                else float(value)
            )

    def expect(self, expected, file):
        for column, (times, values, unit) in self.columns.items():
            expected.channel(file, column, times, values, unit=unit)


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)

    # Every sentence, with the time of receipt in every shape.
    stamp = lambda t, form: datetime.datetime.fromtimestamp(t, datetime.timezone.utc).strftime(
        form
    )
    shapes = {
        "iso": lambda t: stamp(t, "%Y-%m-%dT%H:%M:%S.%fZ "),
        "words": lambda t: stamp(t, "[%Y-%m-%d %H:%M:%S.%f] INFO gps: "),
        "python": lambda t: stamp(t, "%Y-%m-%d %H:%M:%S,") + f"{round(t * 1000) % 1000:03d} - ",
        "epoch": lambda t: f"{t:.3f},",
        "millis": lambda t: f"{t * 1000:.0f}\t",
        "day": lambda t: stamp(t, "%H:%M:%S.%f, "),
        "run": lambda t: f"{t - START:.3f} ",
    }
    # The first day starts 86 380 s before; seconds go on past midnight.
    origins = {"day": START - 86380, "run": START}
    for name, shape in shapes.items():
        columns, lines = Columns(), []
        for k in range(400):
            time_s = START + k / 8
            kind = (STANDARD + OWN)[k % (len(STANDARD) + len(OWN))]
            # Sent a little before it is received.
            text, values = (standard if kind in STANDARD else own)(kind, time_s - 0.1)
            columns.put(time_s - origins.get(name, 0), values)
            lines.append(shape(time_s) + text + "\r\n")
        (folder / f"{name}.log").write_text("".join(lines), newline="")
        columns.expect(expected, f"{name}.log")

    # Damage, text, sentences unknown, no checksum, a pressure sensor; cut in the last sentence.
    columns, lines = Columns(), ["logger v3\n"]
    for k in range(60):
        time_s = START + k / 4
        prefix = f"{time_s:.2f},"
        if k % 3 == 0:
            text, values = standard("HDT", time_s)
            if k % 9 == 3:
                text, values = text.replace(",T", ",t"), []
            if k == 33:
                text, values = text[:-3], []
        elif k % 3 == 1:
            text, values = own("PRDID", time_s)
            text = text[:-3]
        elif k == 20:
            text, values = checked("GPGSV,1,1,00"), []
        else:
            value = number(14, 15, 4)
            text, values = f"*0001{value}", [("PAROSCIENTIFIC-01.pressure", None, value)]
        columns.put(time_s, values)
        lines.append(f"{prefix}{text}\n")
    text = "".join(lines) + f"{START + 15:.2f},$HEHDT,12"
    (folder / "rough.log").write_text(text, newline="")
    columns.expect(expected, "rough.log")

    # No time before sentences: that in them, once a second; a sentence by itself at the end.
    columns, lines = Columns(), []
    for k in range(40):
        time_s = START + k
        if k == 25:
            continue
        text = None
        while text is None or ",A," not in text:
            text, values = standard("RMC", time_s)
        columns.put(time_s, values)
        lines.append(text)
        for part in range(4):
            text, values = standard("HDT", time_s)
            columns.put(
                time_s + (part + 1) / 5
                if k not in (24, 39)
                else time_s + 2 * (part + 1) / 5
                if k == 24
                else float("nan"),
                values,
            )
            lines.append(text)
    (folder / "bare.log").write_text("\r".join(lines) + "\r", newline="")
    for column, (times, values, unit) in columns.columns.items():
        kept = [(t, v) for t, v in zip(times, values) if t == t]
        expected.channel(
            "bare.log", column, [t for t, _ in kept], [v for _, v in kept], unit=unit
        )

    (folder / "timeless.log").write_text(
        "\n".join(standard("HDT", START)[0] for _ in range(9)) + "\n"
    )
    seed = [(STANDARD + OWN)[k % 20] for k in range(40)]
    lines = [
        f"{START + k / 8:.3f} " + (standard if kind in STANDARD else own)(kind, START)[0]
        for k, kind in enumerate(seed)
    ]
    (folder / "seed.log").write_text("\n".join(lines) + "\n")
    (folder / "seed-bare.log").write_text(
        "\n".join(line.split(" ", 1)[1] for line in lines) + "\n"
    )
    expected.save()


main()
