"""Expected channels of the files that the make_*.py scripts write.

    expected = Expected(folder)
    expected.channel("log.mcap", "/imu/angular_velocity.z", time_s, values, unit="rad/s")
    expected.save()

Each script is called with the folder to write to. The values go to expected.f64, eight bytes each,
so that not one bit of them is lost; expected.json says where which are.
"""

import array
import json
import math
import pathlib
import sys


class Expected:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.channels = []
        self.numbers = array.array("d")

    def channel(self, file, column, time_s, values, unit=None):
        """Returns a channel; samples that are None or not finite are missing and left out."""
        pairs = zip(time_s, values, strict=True)
        present = [(float(t), float(v)) for t, v in pairs if v is not None and math.isfinite(v)]
        start = len(self.numbers)
        self.numbers.extend(t for t, _ in present)
        self.numbers.extend(v for _, v in present)
        self.channels.append(
            {
                "file": file,
                "column": column,
                "unit": unit,
                "start": start,
                "count": len(present),
            }
        )

    def save(self):
        if sys.byteorder == "big":
            self.numbers.byteswap()
        (self.folder / "expected.f64").write_bytes(self.numbers.tobytes())
        (self.folder / "expected.json").write_text(json.dumps(self.channels))
