"""Decodes the NMEA log in SEAPLANT_DATA/formats/ardusub with pynmea2.

python3 make_nmea_recordings.py FOLDER
"""

import datetime
import os
import pathlib
import sys

import pynmea2
from expected import Expected

WORKSPACE = pathlib.Path(__file__).resolve().parents[4]
DATA = WORKSPACE / os.environ.get("SEAPLANT_DATA", "../shared/data") / "formats/ardusub"


def main():
    expected = Expected(sys.argv[1])
    columns = {}
    for line in (DATA / "nmea_log.txt").read_text().splitlines():
        before, dollar, sentence = line.partition("$")
        if not dollar:
            continue
        moment = datetime.datetime.fromisoformat(before[:23]).replace(
            tzinfo=datetime.timezone.utc
        )
        got = pynmea2.parse(dollar + sentence, check=True)
        if got.sentence_type == "RMC":
            sign = {"E": 1, "W": -1}[got.mag_var_dir]
            values = [
                ("latitude", "deg", got.latitude),
                ("longitude", "deg", got.longitude),
                ("speed", "kn", got.spd_over_grnd),
                ("course", "deg", got.true_course),
                ("variation", "deg", sign * float(got.mag_variation)),
            ]
        elif got.sentence_type == "GGA":
            values = [
                ("latitude", "deg", got.latitude),
                ("longitude", "deg", got.longitude),
                ("altitude", "m", got.altitude),
                ("quality", None, got.gps_qual),
                ("satellites", None, got.num_sats),
                ("hdop", None, got.horizontal_dil),
            ]
        else:
            assert got.heading is None
            values = []
        for name, unit, value in values:
            column = f"{got.talker}-{got.sentence_type}.{name}"
            times, held, _ = columns.setdefault(column, ([], [], unit))
            times.append(moment.timestamp())
            held.append(float(value))
    for column, (times, values, unit) in columns.items():
        expected.channel("nmea_log.txt", column, times, values, unit=unit)
    expected.save()


main()
