"""Writes workbooks with openpyxl and XlsxWriter.

python3 make_xlsx.py FOLDER
"""

import datetime
import pathlib
import random
import sys

import openpyxl
import xlsxwriter
from expected import Expected
from openpyxl.utils.datetime import CALENDAR_MAC_1904

UTC = datetime.timezone.utc


def main():
    folder = pathlib.Path(sys.argv[1])
    expected = Expected(folder)
    dice = random.Random(5)

    def speed():
        """Returns random numbers, with digits that openpyxl does not round."""
        return round(dice.gauss(0, 1), 12)

    # Remarks above, a row of units, holes, errors, text, a boolean; a second sheet.
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "Dive 12"
    sheet.append(["Dive 12, off the pier"])
    sheet.append([])
    sheet.append(["Time", "u", "Heading (deg)", "T1 (us)", "state", "armed"])
    sheet.append(["s", "m/s"])
    columns = {name: [] for name in ("u", "Heading (deg)", "T1 (us)", "armed")}
    times = []
    for k in range(400):
        u = None if k % 7 == 3 else "#DIV/0!" if k % 11 == 5 else speed()
        heading, pulse, armed = round(dice.uniform(0, 360), 9), 1500 + k, k > 50
        sheet.append([k / 10, u, heading, pulse, "idle", armed])
        times.append(k / 10)
        columns["u"].append(u if isinstance(u, float) else None)
        columns["Heading (deg)"].append(heading)
        columns["T1 (us)"].append(pulse)
        columns["armed"].append(armed)
    units = {"u": "m/s", "Heading (deg)": "deg", "T1 (us)": "us", "armed": None}
    for name, values in columns.items():
        expected.channel("log.xlsx", name, times, values, unit=units[name])
    other = book.create_sheet("Ballast")
    other.append(["t (s)", "mass (kg)"])
    for k in range(10):
        other.append([k, 0.5 * k])
    expected.channel(
        "log.xlsx/Ballast", "mass (kg)", range(10), [0.5 * k for k in range(10)], unit="kg"
    )
    book.create_chartsheet("Plot", 0)
    book.create_sheet("Hidden", 0).sheet_state = "hidden"
    book.save(folder / "log.xlsx")

    # Time as date cells, in both calendars; as times of day; as durations past a day.
    start = datetime.datetime(2020, 7, 31, 13, 50, 28, 500_000)
    dates = [start + datetime.timedelta(milliseconds=130 * k) for k in range(200)]
    stamps = [date.replace(tzinfo=UTC).timestamp() for date in dates]
    speeds = [speed() for _ in dates]
    for name, epoch in [("dates.xlsx", None), ("dates-1904.xlsx", CALENDAR_MAC_1904)]:
        book = openpyxl.Workbook()
        if epoch:
            book.epoch = epoch
        book.active.append(["time", "u (m/s)"])
        for date, u in zip(dates, speeds):
            book.active.append([date, u])
        book.save(folder / name)
        expected.channel(name, "u (m/s)", stamps, speeds, unit="m/s")
    book = openpyxl.Workbook()
    book.active.append(["time", "u (m/s)"])
    for date, u in zip(dates, speeds):
        book.active.append([date.time(), u])
    book.save(folder / "day.xlsx")
    midnight = datetime.datetime(2020, 7, 31)
    of_day = [(date - midnight).total_seconds() for date in dates]
    expected.channel("day.xlsx", "u (m/s)", of_day, speeds, unit="m/s")
    book = openpyxl.Workbook()
    book.active.append(["time (s)", "u (m/s)"])
    spans = [datetime.timedelta(hours=23.9, milliseconds=5000 * k) for k in range(200)]
    for span, u in zip(spans, speeds):
        book.active.append([span, u])
    book.save(folder / "spans.xlsx")
    seconds = [span.total_seconds() for span in spans]
    expected.channel("spans.xlsx", "u (m/s)", seconds, speeds, unit="m/s")

    # A stray cell in the last position of a sheet.
    book = openpyxl.Workbook()
    book.active.append(["t (s)", "u (m/s)"])
    for k in range(20):
        book.active.append([k, 2 * k])
    book.active.cell(1_048_576, 16_384, "end")
    book.save(folder / "far.xlsx")
    expected.channel("far.xlsx", "u (m/s)", range(20), [2 * k for k in range(20)], unit="m/s")

    # XlsxWriter keeps texts in a table of their own, as Excel does.
    for name, rows in [("shared.xlsx", 500), ("seed.xlsx", 30)]:
        book = xlsxwriter.Workbook(folder / name)
        dated = book.add_format({"num_format": "yyyy-mm-dd hh:mm:ss.000"})
        sheet = book.add_worksheet()
        sheet.write_row(0, 0, ["t (s)", "u (m/s)", "state", "when"])
        values = [dice.gauss(0, 1) for _ in range(rows)]
        for k, value in enumerate(values):
            sheet.write_row(k + 1, 0, [k / 8, value, "idle" if k % 2 else "dives"])
            sheet.write_datetime(k + 1, 3, start + datetime.timedelta(seconds=k), dated)
        book.close()
        read = [row[1] for row in openpyxl.load_workbook(folder / name).active.values][1:]
        expected.channel(name, "u (m/s)", [k / 8 for k in range(rows)], read, unit="m/s")
    openpyxl.Workbook().save(folder / "empty.xlsx")
    expected.save()


if __name__ == "__main__":
    main()
