"""Fleets of dives: thousands of campaigns, on the cores of this machine or on a Dask cluster.

Examples
--------
>>> import tempfile, pathlib, seaplant as sp
>>> folder = pathlib.Path(tempfile.mkdtemp())
>>> spec = {"dofs": ["surge"], "duration_s": 60.0, "hold_out_s": 60.0}
>>> dives = [sp.twin(spec, seed=k).write(folder / f"dive {k}") for k in range(3)]
>>> fleet = sp.fleet.identify(dives, out=folder / "fleet", method="equation-error")
>>> list(fleet.to_pandas()["dive"])
['dive 0', 'dive 1', 'dive 2']
"""

from seaplant.fleet._dives import Dive
from seaplant.fleet._fleet import Fleet, identify
from seaplant.fleet._summary import Summary, Trend

__all__ = ["Dive", "Fleet", "Summary", "Trend", "identify"]
