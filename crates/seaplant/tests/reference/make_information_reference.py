"""Fisher information of a boat's trial by pyomo.contrib.doe, for tests/information_against_pyomo.rs.

    pip install pyomo==6.10.1 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 packaging matplotlib
    python make_information_reference.py > information.json

The boat has surge, sway and yaw:

    m_u u' = m_v v r − d_u u − D_u |u| u + X
    m_v v' = −m_u u r − d_v v − D_v |v| v + Y
    m_r r' = (m_u − m_v) u v − d_r r − D_r |r| r + N

with (u, v) relative to the water, whose velocity north and east is unknown to 1 m/s; heading is known.
The boat begins at rest, as well as one sample of velocity tells.
Forces are held for 0.2 s, and are zero for the first 0.6 s. Velocity over ground is measured every 0.2 s. pyomo.dae discretises the
equations by collocation, and pyomo.contrib.doe differentiates their solution. Its solver is Newton's
method with derivatives by Pyomo, since the equations have as many unknowns: no other is needed.
"""

import json
import math

import numpy as np
import pandas
import pyomo
import pyomo.environ as pyo
import scipy
from pyomo.contrib.doe import DesignOfExperiments
from pyomo.contrib.parmest.experiment import Experiment
from pyomo.core.expr.calculus.derivatives import Modes, differentiate
from pyomo.core.expr.visitor import identify_variables
from pyomo.dae import ContinuousSet, DerivativeVar
from pyomo.opt import SolverResults, SolverStatus, TerminationCondition
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

STEP_S = 0.2
REST = 3
STEPS = 120 + REST
POINTS = 3
COEFFICIENTS = {
    "mass.surge": 120.0,
    "mass.sway": 170.0,
    "mass.yaw": 30.0,
    "surge: u": 12.0,
    "surge: |u|u": 40.0,
    "sway: v": 25.0,
    "sway: |v|v": 90.0,
    "yaw: r": 6.0,
    "yaw: |r|r": 15.0,
}
STD = {"u": 0.01, "v": 0.012, "r": 0.005}
CURRENT_STD = 1.0


def force(k):
    """Return surge force, sway force and yaw moment of an interval."""
    if k < REST:
        return (0.0, 0.0, 0.0)
    t = (k - REST) * STEP_S
    return (
        40.0 * math.sin(0.5 * t) + 25.0 * math.cos(1.3 * t),
        30.0 * math.sin(0.8 * t + 1.0),
        9.0 * math.cos(0.6 * t) - 4.0 * math.sin(1.7 * t),
    )


class Newton:
    """Solves as many equations as there are unknowns."""

    def solve(self, model, tee=False):
        """Solve the active equalities of a model for its free variables."""
        rows = list(model.component_data_objects(pyo.Constraint, active=True))
        used = [[v for v in identify_variables(c.body) if not v.fixed] for c in rows]
        variables = list({id(v): v for row in used for v in row}.values())
        place = {id(v): k for k, v in enumerate(variables)}
        assert len(rows) == len(variables), (len(rows), len(variables))
        for _ in range(30):
            misfit = np.array([pyo.value(c.body) - pyo.value(c.upper) for c in rows])
            entries = []
            for i, (c, row) in enumerate(zip(rows, used, strict=True)):
                slopes = differentiate(c.body, wrt_list=row, mode=Modes.reverse_numeric)
                entries += [(i, place[id(v)], s) for v, s in zip(row, slopes, strict=True)]
            i, j, slope = zip(*entries, strict=True)
            matrix = coo_matrix((slope, (i, j)), shape=(len(rows), len(rows))).tocsr()
            change = spsolve(matrix, -misfit)
            for v, by in zip(variables, change, strict=True):
                v.set_value(v.value + by, skip_validation=True)
            if np.abs(change).max() < 1e-11:
                break
        else:
            raise RuntimeError("Newton's method does not converge")
        results = SolverResults()
        results.solver.status = SolverStatus.ok
        results.solver.termination_condition = TerminationCondition.optimal
        return results


def size(x):
    """Return |x| with a slope at zero."""
    return pyo.sqrt(x**2 + 1e-14)


def boat(heading=None):
    """Return the discretised boat; heading is integrated if none is given."""
    m = pyo.ConcreteModel()
    m.t = ContinuousSet(initialize=[round(STEP_S * k, 9) for k in range(STEPS + 1)])
    m.u, m.v, m.r, m.psi = (pyo.Var(m.t, initialize=0.0) for _ in range(4))
    m.du, m.dv, m.dr, m.dpsi = (DerivativeVar(x, wrt=m.t) for x in (m.u, m.v, m.r, m.psi))
    m.p = pyo.Var(list(COEFFICIENTS), initialize=COEFFICIENTS)
    # A parameter of zero has no relative step.
    m.water = pyo.Var(["north", "east"], initialize=1.0)
    m.start = pyo.Var(list(STD), initialize=1.0)
    m.gain = pyo.Var(initialize=1.0)
    m.p.fix()
    m.water.fix()
    m.start.fix()
    m.gain.fix()
    p = m.p

    def held(t, axis):
        return m.gain * force(max(math.ceil(t / STEP_S - 1e-6) - 1, 0))[axis]

    @m.Constraint(m.t)
    def surge(m, t):
        drag = p["surge: u"] * m.u[t] + p["surge: |u|u"] * size(m.u[t]) * m.u[t]
        turning = p["mass.sway"] * m.v[t] * m.r[t]
        return p["mass.surge"] * m.du[t] - turning + drag - held(t, 0) == 0

    @m.Constraint(m.t)
    def sway(m, t):
        drag = p["sway: v"] * m.v[t] + p["sway: |v|v"] * size(m.v[t]) * m.v[t]
        turning = -p["mass.surge"] * m.u[t] * m.r[t]
        return p["mass.sway"] * m.dv[t] - turning + drag - held(t, 1) == 0

    @m.Constraint(m.t)
    def yaw(m, t):
        drag = p["yaw: r"] * m.r[t] + p["yaw: |r|r"] * size(m.r[t]) * m.r[t]
        munk = (p["mass.surge"] - p["mass.sway"]) * m.u[t] * m.v[t]
        return p["mass.yaw"] * m.dr[t] - munk + drag - held(t, 2) == 0

    pyo.TransformationFactory("dae.collocation").apply_to(m, nfe=STEPS, ncp=POINTS)
    for slope in (m.du, m.dv, m.dr, m.dpsi):
        for t in m.t:
            slope[t].set_value(0.0)
    north, east = m.water["north"] - 1.0, m.water["east"] - 1.0
    if heading is None:
        m.turning = pyo.Constraint(m.t, rule=lambda m, t: m.dpsi[t] - m.r[t] == 0)
        m.psi[0.0].fix(0.0)
    else:
        for t in m.t:
            m.psi[t].fix(heading[t])
        m.dpsi_disc_eq.deactivate()
    start = {axis: m.start[axis] - 1.0 for axis in STD}
    m.start_u = pyo.Constraint(expr=m.u[0.0] + north - start["u"] == 0)
    m.start_v = pyo.Constraint(expr=m.v[0.0] + east - start["v"] == 0)
    m.start_r = pyo.Constraint(expr=m.r[0.0] - start["r"] == 0)
    # Over ground, at the instants of the measurement.
    m.at = pyo.Set(initialize=[round(STEP_S * k, 9) for k in range(1, STEPS + 1)])
    m.ground = pyo.Var(["u", "v", "r"], m.at, initialize=0.0)

    @m.Constraint(["u", "v", "r"], m.at)
    def measured(m, axis, t):
        c, s = pyo.cos(m.psi[t]), pyo.sin(m.psi[t])
        water = {"u": north * c + east * s, "v": east * c - north * s, "r": 0.0}[axis]
        return m.ground[axis, t] - {"u": m.u, "v": m.v, "r": m.r}[axis][t] - water == 0

    return m


class Trial(Experiment):
    """The trial, labelled as pyomo.contrib.doe wants it."""

    def __init__(self, heading):
        self.heading = heading
        self.model = None

    def get_labeled_model(self):
        """Return the model with its outputs, errors, inputs and parameters."""
        if self.model is None:
            m = self.model = boat(self.heading)
            places = list(m.ground.keys())
            for name in (
                "experiment_outputs",
                "measurement_error",
                "experiment_inputs",
                "unknown_parameters",
            ):
                setattr(m, name, pyo.Suffix(direction=pyo.Suffix.LOCAL))
            m.experiment_outputs.update((m.ground[place], None) for place in places)
            m.measurement_error.update((m.ground[place], STD[place[0]]) for place in places)
            m.experiment_inputs[m.gain] = None
            m.unknown_parameters.update((x, x.value) for x in m.p.values())
            m.unknown_parameters.update((x, x.value) for x in m.water.values())
            m.unknown_parameters.update((x, x.value) for x in m.start.values())
        return self.model


nominal = boat()
Newton().solve(nominal)
heading = {t: nominal.psi[t].value for t in nominal.t}
n = len(COEFFICIENTS)
prior = np.diag([0.0] * n + [CURRENT_STD**-2] * 2 + [std**-2 for std in STD.values()])
doe = DesignOfExperiments(
    Trial(heading), fd_formula="central", step=1e-3, solver=Newton(), prior_FIM=prior
)
fim = np.array(doe.compute_FIM(method="sequential"))
information = fim[:n, :n] - fim[:n, n:] @ np.linalg.solve(fim[n:, n:], fim[n:, :n])
times = [round(STEP_S * k, 9) for k in range(STEPS + 1)]
print(
    json.dumps(
        {
            "versions": {
                "pyomo": pyomo.__version__,
                "numpy": np.__version__,
                "scipy": scipy.__version__,
                "pandas": pandas.__version__,
            },
            "step_s": STEP_S,
            "std": STD,
            "coefficients": COEFFICIENTS,
            "force": [force(k) for k in range(STEPS + 1)],
            "heading": [heading[t] for t in times],
            "velocity": [
                [
                    {"u": nominal.u, "v": nominal.v, "r": nominal.r}[axis][t].value
                    for axis in "uvr"
                ]
                for t in times
            ],
            "information": information.tolist(),
        }
    )
)
