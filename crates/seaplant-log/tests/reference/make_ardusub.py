"""Reads third-party logs of ArduSub with pymavlink.

SEAPLANT_DATA=... python3 make_ardusub.py FOLDER
"""

import os
import pathlib
import sys

import dataflash
import tlog
from expected import Expected


def main():
    logs = pathlib.Path(os.environ["SEAPLANT_DATA"]) / "formats/ardusub"
    expected = Expected(sys.argv[1])
    dataflash.expect(expected, logs / "small.BIN", "small.BIN")
    tlog.expect(expected, logs / "small.tlog", "small.tlog")
    expected.save()


if __name__ == "__main__":
    main()
