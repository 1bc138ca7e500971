// Marks stretches of a log as trials: their entries for campaign.toml.
(() => {
  "use strict";
  const output = document.getElementById("marks");
  const marks = [];

  function entry([from, to], k) {
    return [
      "[[trial]]",
      `name = "trial ${k + 1}"`,
      `log = ${output.dataset.logs}`,
      'dof = ["surge"]  # decide',
      `from_s = ${from.toFixed(1)}`,
      `to_s = ${to.toFixed(1)}`,
    ].join("\n");
  }

  function show(chart) {
    for (const panel of chart.chart.panels) panel.bands = [...marks];
    chart.draw();
    output.textContent = marks.map(entry).join("\n\n");
    output.hidden = marks.length === 0;
    // The page that this one is a part of, if it is one, offers them for a form.
    if (window.parent !== window) window.parent.postMessage({ marks }, "*");
  }

  document.addEventListener("chart", ({ detail: chart }) => {
    chart.button("Mark what is shown as a trial", "Mark trial", () => {
      marks.push([...chart.range]);
      show(chart);
    });
    chart.button("Forget the last mark", "Undo", () => {
      marks.pop();
      show(chart);
    });
  });
})();
