"use strict";
const last = Number(document.body.dataset.last);
const logs = document.body.dataset.logs;
const marks = [];
const place = (event, chart) => {
  const box = chart.getBoundingClientRect();
  return (Math.min(Math.max(event.clientX - box.left, 0), box.width) / box.width) * last;
};
const shown = () => {
  document.querySelectorAll(".mark").forEach((mark) => mark.remove());
  for (const figure of document.querySelectorAll("figure")) {
    for (const [from, to] of marks) {
      const mark = document.createElement("div");
      mark.className = "mark";
      mark.style.left = `${(100 * from) / last}%`;
      mark.style.width = `${(100 * (to - from)) / last}%`;
      figure.append(mark);
    }
  }
  const text = marks.map(([from, to], k) => [
    "[[trial]]",
    `name = "trial ${k + 1}"`,
    `log = ${logs}`,
    'dof = ["surge"]  # decide',
    `from_s = ${from.toFixed(1)}`,
    `to_s = ${to.toFixed(1)}`,
  ].join("\n"));
  const output = document.getElementById("marks");
  output.textContent = text.join("\n\n");
  output.hidden = marks.length === 0;
};
for (const chart of document.querySelectorAll("svg")) {
  let from = null;
  chart.addEventListener("pointerdown", (event) => {
    from = place(event, chart);
    chart.setPointerCapture(event.pointerId);
    marks.push([from, from]);
  });
  chart.addEventListener("pointermove", (event) => {
    if (from === null) return;
    const to = place(event, chart);
    marks[marks.length - 1] = [Math.min(from, to), Math.max(from, to)];
    shown();
  });
  chart.addEventListener("pointerup", () => {
    from = null;
    const [start, end] = marks[marks.length - 1];
    if (end - start < last / 500) marks.pop();
    shown();
  });
}
