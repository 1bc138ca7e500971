"""Identifies plant models of marine vehicles: mass, drag and their uncertainty.

A vehicle with known thrusters is driven and logged; for each degree of freedom Seaplant finds
``v' = α τ + β v|v| + μ v + bias``, or in physical terms mass, quadratic and linear drag and a
bias force, with 95 % intervals, scores on held-out trials and reasons for doubt.

Examples
--------
>>> import seaplant as sp
>>> dive = sp.twin(dofs=["surge"], duration_s=120)
>>> fit = sp.identify(dive.trials, dive.vehicle)
>>> fit["surge"].method
'filter-error'
"""

from seaplant import errors, fleet, plants, plots, thruster
from seaplant._channel import Channel
from seaplant._native import version as _version
from seaplant._results import (
    AccumulatedPlant,
    BollardPullResult,
    Caveat,
    Coefficient,
    Parameter,
    PlantResult,
    Results,
    SteadyResult,
    Validation,
)
from seaplant._simulation import Simulation
from seaplant.controllers import Controller
from seaplant.errors import FileError, InputError, MissingFileError
from seaplant.estimator import PlantEstimator
from seaplant.fits import Fit
from seaplant.identification import identify, identify_campaign, steady_drag
from seaplant.logs import Log
from seaplant.online import Online, OnlineEstimate, PlantChange
from seaplant.plants import Linear, Motion, Plant
from seaplant.shards import ShardClock, Shards, accumulate
from seaplant.trials import Axis, Trial
from seaplant.twins import Twin, monte_carlo, monte_carlo_frame, twin
from seaplant.vehicles import (
    Attitude,
    Dvl,
    PositionSensor,
    PresetCurve,
    QuadraticCurve,
    Sensors,
    TableCurve,
    Thruster,
    ThrustUncertainty,
    Vehicle,
)

__version__ = _version()

__all__ = [
    "AccumulatedPlant",
    "Attitude",
    "Axis",
    "BollardPullResult",
    "Caveat",
    "Channel",
    "Coefficient",
    "Controller",
    "Dvl",
    "FileError",
    "Fit",
    "InputError",
    "Linear",
    "Log",
    "MissingFileError",
    "Motion",
    "Online",
    "OnlineEstimate",
    "Parameter",
    "Plant",
    "PlantChange",
    "PlantEstimator",
    "PlantResult",
    "PositionSensor",
    "PresetCurve",
    "QuadraticCurve",
    "Results",
    "Sensors",
    "ShardClock",
    "Shards",
    "Simulation",
    "SteadyResult",
    "TableCurve",
    "ThrustUncertainty",
    "Thruster",
    "Trial",
    "Twin",
    "Validation",
    "Vehicle",
    "__version__",
    "accumulate",
    "errors",
    "fleet",
    "identify",
    "identify_campaign",
    "monte_carlo",
    "monte_carlo_frame",
    "plants",
    "plots",
    "steady_drag",
    "thruster",
    "twin",
]
