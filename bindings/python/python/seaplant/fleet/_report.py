"""The summary of a fleet as one HTML file."""

from __future__ import annotations

import html
from string import Template
from typing import TYPE_CHECKING

from seaplant import _native
from seaplant.fleet._summary import Slope, Summary, Trend
from seaplant.plots import as_html

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_PAGE = Template("""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Fleet of $dives dives</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto }
table { border-collapse: collapse; margin: 1rem 0 }
th, td { padding: .25rem .7rem; border-bottom: 1px solid #ddd; text-align: left }
td.number { text-align: right; font-variant-numeric: tabular-nums }
.sure { font-weight: 600 }
figure { margin: 1rem 0 } img { max-width: 100% }
</style></head><body>
<h1>Fleet of $dives dives</h1>
<p>$plants plants, $failed failures; Seaplant $version.</p>
<h2>Parameters over dives</h2>
<p>Scatter is that of the estimates, their drift taken out; expected is what their own intervals
say. Changes in bold have 95 % intervals that exclude none.</p>
<table><thead><tr><th>dof</th><th>parameter</th><th>dives</th><th>median</th><th>scatter</th>
<th>expected</th><th>change a year</th><th>change a kg of payload</th><th>stand out</th></tr>
</thead><tbody>$trends</tbody></table>
$figures
<h2>Caveats</h2>
<table><thead><tr><th>caveat</th><th>plants</th></tr></thead><tbody>$caveats</tbody></table>
<h2>Failures</h2>
<table><thead><tr><th>dive</th><th>dof</th><th>reason</th></tr></thead>
<tbody>$failures</tbody></table>
</body></html>
""")


def page(frame: pd.DataFrame, summary: Summary) -> str:
    """Returns the HTML text."""
    found = frame[frame["status"] == "found"]
    failed = frame[frame["status"] == "failed"]
    return _PAGE.substitute(
        dives=frame["key"].nunique(),
        plants=len(found),
        failed=len(failed),
        version=html.escape(_native.version()),
        trends="".join(map(_trend, summary.trends)),
        figures="".join(_figure(of, found) for of in summary.trends),
        caveats="".join(_row(code, str(n)) for code, n in summary.caveats.items()),
        failures="".join(
            _row(str(of.dive), str(of.dof or ""), str(of.reason)) for of in failed.itertuples()
        )
        or _row("none", "", ""),
    )


def _row(*cells: str) -> str:
    return "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>"


def _trend(of: Trend) -> str:
    median, scatter, _, _ = _native.rounded(of.median, of.scatter, of.median, of.median)
    _, expected, _, _ = _native.rounded(of.median, of.expected, of.median, of.median)
    cells = [f"<td>{html.escape(cell)}</td>" for cell in (of.dof, of.parameter)]
    numbers = (str(of.dives), f"{median} {of.unit}", scatter, expected)
    cells += [f'<td class="number">{html.escape(cell)}</td>' for cell in numbers]
    cells += [_change(slope) for slope in (of.with_date, of.with_payload)]
    cells.append(f"<td>{html.escape(', '.join(of.outliers))}</td>")
    return f"<tr>{''.join(cells)}</tr>"


def _change(slope: Slope | None) -> str:
    if slope is None:
        return '<td class="number">–</td>'
    kind = "number sure" if slope.is_sure else "number"
    return f'<td class="{kind}">{slope.value:.3g} [{slope.low95:.3g}, {slope.high95:.3g}]</td>'


def _figure(of: Trend, found: pd.DataFrame) -> str:
    return as_html(draw(of, found), f"{of.parameter} of {of.dof} over dives")


def draw(of: Trend, found: pd.DataFrame) -> Figure:
    """Draws a parameter of every dive with its 95 % interval, by date or else in order."""
    from matplotlib.figure import Figure

    rows = found[(found["dof"] == of.dof) & found[of.parameter].notna()]
    dated = rows["date"].notna().all()
    x = rows["date"].to_numpy() if dated else range(1, len(rows) + 1)
    values = rows[of.parameter].to_numpy()
    low = values - rows[f"{of.parameter}_low95"].to_numpy()
    high = rows[f"{of.parameter}_high95"].to_numpy() - values
    figure = Figure(figsize=(8.0, 2.6), layout="constrained")
    panel = figure.subplots()
    panel.errorbar(x, values, yerr=[low, high], fmt="o", ms=3, lw=0.7, color="C0", alpha=0.7)
    apart = rows["dive"].isin(of.outliers).to_numpy()
    if apart.any():
        marked = rows["date"].to_numpy()[apart] if dated else apart.nonzero()[0] + 1
        panel.plot(marked, values[apart], "o", mfc="none", ms=9, color="C3", label="stands out")
        panel.legend(fontsize=8)
    panel.axhline(of.median, lw=0.7, color="0.5")
    panel.set_ylabel(f"{of.dof} {of.parameter.replace('_', ' ')}\n[{of.unit}]")
    panel.set_xlabel("date" if dated else "dive")
    return figure
