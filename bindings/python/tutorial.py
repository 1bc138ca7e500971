# %% [markdown]
# # From a log to a plant that can be trusted
#
# Load, look, identify, doubt, validate, plot: the whole way once, on the digital twin of the
# Jason 2 ROV, whose truth is known. Cells begin with `# %%`: Jupyter (by jupytext), VS Code,
# Spyder and PyCharm run them one by one; `python tutorial.py` runs them all.

# %%
import tempfile
from pathlib import Path

import numpy as np
import seaplant as sp

# %% [markdown]
# ## Load
#
# The twin stands in for a dive: 8 minutes of sinusoid and joystick in surge, and 5 minutes of
# steps to judge the result by. Its propellers follow their logged speed late, by a lag of
# 0.3 s, and a current of 0.1 m/s runs: things that no log states. It writes ordinary CSV files.

# %%
folder = Path(tempfile.mkdtemp()) / "dive"
twin = sp.twin(dofs=["surge"], disturbances=["lag", "current"], seed=7)
campaign = twin.write(folder)
print(campaign.read_text()[:400])

# %% [markdown]
# Any format that the command line reads is read by `Log.open`; the format is detected from
# content. What the reader assumed or dropped is in `log.notes`. Arrays, frames and datasets go
# in by `Log.of`.

# %%
log = sp.Log.open(*sorted((folder / "logs/surge-1").glob("*.csv")))
print(log)
print(log["velocity x"])

# %% [markdown]
# ## Look
#
# Rates, spans, gaps, ranges and what is odd about each channel; then the numbers themselves.

# %%
table = log.summary()
print(table[["column", "unit", "count", "rate_hz", "min", "max", "remarks"]].to_string())
frame = log.to_pandas()
print(frame["velocity x [m/s]"].describe())

# %% [markdown]
# A trial is one stretch of a log for one vehicle: which column holds which quantity, and what
# it is for. Here thruster speeds become a force along surge, and the DVL's velocity that of the
# vehicle's origin.

# %%
vehicle = sp.Vehicle(folder / "vehicle.toml")
channels = {
    "thruster.fore-aft port.speed": "fore-aft port",
    "thruster.fore-aft starboard.speed": "fore-aft starboard",
    "dvl.velocity.x": "velocity x",
    "dvl.velocity.y": "velocity y",
    "dvl.velocity.z": "velocity z",
    "attitude.roll": "roll",
    "attitude.pitch": "pitch",
    "attitude.heading": "heading",
}
steps = sp.Log.open(*sorted((folder / "logs/surge-hold-out").glob("*.csv")))
trial = sp.Trial(log, vehicle, "surge", channels=channels, name="surge 1")
held_out = sp.Trial(steps, vehicle, "surge", channels=channels, name="steps", role="hold-out")
print(trial, held_out)
print(trial.axis().to_pandas().describe())

# %% [markdown]
# ## Identify
#
# Four methods at once: filter-error, which is recommended; output-error and equation-error; and
# the paper's, kept exact. Scores are on raw velocity, of trials that the fit has not seen.

# %%
fit = sp.identify([trial, held_out], vehicle)
print(fit)
surge = fit["surge"]
print(surge.nuisances)

# %% [markdown]
# The truth is known, which no real dive offers. The recommended method finds mass and drag, and
# the lag that no file states. The paper's is off by far: it smooths velocity at the very
# frequency of the sinusoid, and leaves thrust as it is.

# %%
truth = twin.truth.plants["surge"]
for method, plant in fit.methods["surge"].items():
    mass = plant.parameters["mass.surge"]
    print(f"{method:15} mass {mass}, off by {100.0 * (mass.value / truth.mass - 1.0):+.1f} %")

mass, drag = surge.parameters["mass.surge"], surge.parameters["surge: |u|u"]
assert abs(mass.value / truth.mass - 1.0) < 0.02
assert abs(drag.value / truth.quadratic_drag - 1.0) < 0.05
assert abs(surge.nuisances["lag"].value - twin.truth.nuisances.lag_s) < 0.1
assert fit.methods["surge"]["paper"].parameters["mass.surge"].value > 1.5 * truth.mass

# %% [markdown]
# ## Doubt
#
# Caveats are data: a code, how much it matters, and words that say what to do.

# %%
for caveat in fit.caveats:
    print(f"{caveat.severity:8} {caveat.code}: {caveat.message}")
codes = {caveat.code for caveat in fit.methods["surge"]["equation-error"].caveats}
print("equation-error is doubted for", ", ".join(sorted(codes)))
assert "lag-or-delay" in codes

# %% [markdown]
# Why the model has the parts that it has: what each candidate gains in likelihood, and what it
# would have needed.

# %%
for decision in surge.structure:
    print(
        f"{decision.candidate:15} {decision.likelihood_ratio:8.1f} of {decision.needed:.1f}",
        "admitted" if decision.admitted else "",
    )

# %% [markdown]
# ## Validate
#
# Another dive, another seed: the plant is driven with its thrust, and compared with its
# velocity.

# %%
other = sp.twin(dofs=["surge"], disturbances=["lag"], seed=8)
(validation,) = fit.validate(other.trials)
print(validation.score.by_axis["surge"])
simulation = fit.simulate(other.trials[1])
print(simulation)
assert simulation.r_squared is not None and simulation.r_squared > 0.9
assert simulation.mean_abs_error < 0.3 * simulation.null_error
assert np.isfinite(simulation.simulated).all()

# %% [markdown]
# ## Plot
#
# Model and measured velocity above, their difference below, as in the paper's figures 3 to 6.
# In a notebook the figure shows itself; `fit` shows its table with intervals.

# %%
figure = fit.plot("surge")
figure.savefig(folder / "surge.png")

# %% [markdown]
# Everything at once, as the command line writes it: results.json, report.html, figures, tables.

# %%
fit.save(folder / "results")
again = sp.Fit.open(folder / "results/results.json")
assert again.results == fit.results
print(sorted(path.name for path in (folder / "results").iterdir()))
