// Draws the charts of a page with uPlot, from the data in the page. Knows nothing of vehicles.
(() => {
  "use strict";
  const sheet = JSON.parse(document.getElementById("sheet").textContent);
  const charts = new Map(sheet.charts.map((chart) => [chart.id, chart]));
  const night = matchMedia("(prefers-color-scheme: dark)");
  const MISSING = 0xffff;

  // Values as the report packs them: see `Values` in Seaplant's report.
  async function unpack(values) {
    if (Array.isArray(values)) return values;
    const { count, low, step, data } = values;
    if (data === undefined) {
      const off = values.off ? await unpack(values.off) : null;
      return Array.from({ length: count }, (_, k) => values.from + k * step + (off ? off[k] : 0));
    }
    const packed = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const numbers = new Array(count);
    let code = 0;
    for (let k = 0; k < count; k++) {
      code = (code + ((bytes[k] << 8) | bytes[count + k])) & 0xffff;
      numbers[k] = code === MISSING ? null : low + step * code;
    }
    return numbers;
  }

  async function unpackPanel(panel) {
    const lines = await Promise.all(
      panel.lines.map(async (line) => ({
        y: await unpack(line.y),
        interval: line.interval ? await Promise.all(line.interval.map(unpack)) : null,
      })),
    );
    return { x: await unpack(panel.x), lines };
  }

  // Paper is white, whatever the screen is.
  const root = document.documentElement;
  const colour = (ink) => (night.matches && !root.classList.contains("on-paper") ? ink.dark : ink.light);
  const token = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // Four digits, with the sign and the point of the report's own numbers.
  function short(value) {
    if (value === null || value === undefined) return "–";
    const size = Math.abs(value);
    const text =
      size !== 0 && (size < 1e-3 || size >= 1e6)
        ? value.toExponential(3)
        : String(Number(value.toPrecision(4)));
    return text.replace("-", "−");
  }

  // Draws what uPlot has no word for: bands, marks, levels and intervals.
  function extras(panel, data) {
    const inside = (u, draw) => {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      draw(ctx, bbox);
      ctx.restore();
    };
    const bands = (u) =>
      inside(u, (ctx, bbox) => {
        ctx.fillStyle = colour(sheet.inks.fz);
        for (const [from, to] of panel.bands) {
          const left = u.valToPos(from, "x", true);
          ctx.fillRect(left, bbox.top, u.valToPos(to, "x", true) - left, bbox.height);
        }
      });
    const rules = (u) =>
      inside(u, (ctx, bbox) => {
        ctx.lineWidth = devicePixelRatio;
        ctx.strokeStyle = colour(sheet.inks.fa);
        ctx.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
        for (const level of panel.levels) {
          const y = u.valToPos(level, "y", true);
          stroke(ctx, [bbox.left, y], [bbox.left + bbox.width, y]);
        }
        ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
        ctx.fillStyle = colour(sheet.inks.ff);
        for (const [at, word] of panel.marks) {
          const x = u.valToPos(at, "x", true);
          stroke(ctx, [x, bbox.top], [x, bbox.top + bbox.height]);
          ctx.fillText(word, x + 4 * devicePixelRatio, bbox.top + 12 * devicePixelRatio);
        }
      });
    const intervals = (u) => {
      const { ctx } = u;
      ctx.save();
      ctx.lineWidth = 1.6 * devicePixelRatio;
      panel.lines.forEach((line, k) => {
        const ends = data.lines[k].interval;
        if (!ends || !u.series[k + 1].show) return;
        ctx.strokeStyle = colour(sheet.inks[line.ink]);
        const half = 6 * devicePixelRatio;
        data.x.forEach((at, n) => {
          if (ends[0][n] === null || ends[1][n] === null) return;
          const x = u.valToPos(at, "x", true);
          const [low, high] = ends.map((end) => u.valToPos(end[n], "y", true));
          stroke(ctx, [x, low], [x, high]);
          for (const y of [low, high]) stroke(ctx, [x - half, y], [x + half, y]);
        });
      });
      ctx.restore();
    };
    return { hooks: { drawClear: [bands], drawAxes: [rules], draw: [intervals] } };
  }

  function stroke(ctx, from, to) {
    ctx.beginPath();
    ctx.moveTo(...from);
    ctx.lineTo(...to);
    ctx.stroke();
  }

  // The range of y around what is shown, intervals and levels included.
  function around(panel, data) {
    return (u, least, greatest) => {
      let low = least ?? 0;
      let high = greatest ?? 1;
      const ends = data.lines.flatMap((line) => (line.interval ? line.interval.flat() : []));
      const isPoints = ends.length > 0;
      for (const end of [...ends.filter((end) => end !== null), ...panel.levels]) {
        low = Math.min(low, end);
        high = Math.max(high, end);
      }
      const room = (high - low) * (isPoints ? 0.12 : 0.06) || Math.abs(high) * 0.1 || 1;
      return [low - room, high + room];
    };
  }

  class LiveChart {
    constructor(figure, chart) {
      this.figure = figure;
      this.chart = chart;
      this.plots = [];
      this.linking = false;
      this.room = figure.querySelector(".panels");
    }

    async start() {
      this.data = await Promise.all(this.chart.panels.map(unpackPanel));
      const ends = this.data.map(({ x }) => [x[0], x[x.length - 1]]);
      const margin = this.counts() ? 0.5 : 0;
      this.whole = [
        Math.min(...ends.map((end) => end[0])) - margin,
        Math.max(...ends.map((end) => end[1])) + margin,
      ];
      this.range = this.whole;
      this.shown = this.chart.panels.map((panel) => panel.lines.map((line) => line.shown));
      this.places = this.chart.panels.map((panel) => this.place(panel));
      this.tools();
      this.draw();
      this.figure.classList.add("live");
      document.dispatchEvent(new CustomEvent("chart", { detail: this }));
      new ResizeObserver(() => this.resize()).observe(this.room);
      night.addEventListener("change", () => this.draw());
    }

    // Where a panel is drawn, under its name.
    place(panel) {
      const place = document.createElement("div");
      place.className = "panel";
      const label = document.createElement("p");
      label.textContent = panel.label;
      place.append(label);
      this.room.append(place);
      return place;
    }

    // Whether the axis counts things, such as methods.
    counts() {
      return this.chart.x.names.length > 0;
    }

    button(label, text, act) {
      const made = document.createElement("button");
      made.type = "button";
      made.textContent = text;
      made.setAttribute("aria-label", label);
      made.title = label;
      made.addEventListener("click", act);
      this.bar.append(made);
    }

    tools() {
      this.room.classList.toggle("counts", this.counts());
      this.bar = this.figure.querySelector(".tools");
      if (!this.counts()) this.movers();
      this.button("Save what is shown as a PNG file", "PNG", () => this.save());
    }

    movers() {
      this.button("Zoom in", "+", () => this.zoom(0.5));
      this.button("Zoom out", "−", () => this.zoom(2));
      this.button("Move left", "◀", () => this.pan(-0.25));
      this.button("Move right", "▶", () => this.pan(0.25));
      this.button("Show all", "Whole", () => this.show(this.whole));
      this.span = document.createElement("output");
      this.bar.append(this.span);
      this.room.tabIndex = 0;
      this.room.setAttribute("role", "application");
      this.room.setAttribute(
        "aria-label",
        `${this.chart.title}. Arrow keys move, plus and minus zoom, 0 shows all.`,
      );
      this.room.addEventListener("keydown", (event) => this.key(event));
      this.room.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    }

    // The panels below each other, each under its name, on the page's paper.
    save() {
      const scale = devicePixelRatio;
      const line = 22 * scale;
      const canvases = this.plots.map((plot) => plot.ctx.canvas);
      const paper = document.createElement("canvas");
      paper.width = Math.max(...canvases.map((canvas) => canvas.width));
      paper.height = canvases.reduce((sum, canvas) => sum + canvas.height + line, line);
      const ctx = paper.getContext("2d");
      ctx.fillStyle = token("--paper");
      ctx.fillRect(0, 0, paper.width, paper.height);
      ctx.fillStyle = token("--ink");
      ctx.font = `600 ${13 * scale}px system-ui, sans-serif`;
      ctx.fillText(this.chart.title, 8 * scale, 15 * scale);
      let y = line;
      canvases.forEach((canvas, k) => {
        ctx.font = `${12 * scale}px system-ui, sans-serif`;
        ctx.fillText(this.chart.panels[k].label, 8 * scale, y + 15 * scale);
        ctx.drawImage(canvas, 0, y + line);
        y += line + canvas.height;
      });
      const link = document.createElement("a");
      link.download = `${this.chart.id}.png`;
      link.href = paper.toDataURL("image/png");
      link.click();
    }

    key(event) {
      const act = {
        ArrowLeft: () => this.pan(-0.1),
        ArrowRight: () => this.pan(0.1),
        "+": () => this.zoom(0.5),
        "=": () => this.zoom(0.5),
        "-": () => this.zoom(2),
        0: () => this.show(this.whole),
      }[event.key];
      if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act();
    }

    // The wheel alone scrolls the page.
    wheel(event) {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      const by = event.deltaY || event.deltaX;
      const over = this.plots.find((plot) => plot.root.contains(event.target));
      const at = over ? over.posToVal(over.cursor.left, "x") : undefined;
      this.zoom(by > 0 ? 1.25 : 0.8, at);
    }

    toLine(value) {
      return this.chart.x.logarithmic ? Math.log(value) : value;
    }

    fromLine(value) {
      return this.chart.x.logarithmic ? Math.exp(value) : value;
    }

    zoom(factor, about) {
      const [low, high] = this.range.map((end) => this.toLine(end));
      const at = about === undefined ? (low + high) / 2 : this.toLine(about);
      this.show([at + (low - at) * factor, at + (high - at) * factor].map((x) => this.fromLine(x)));
    }

    pan(part) {
      const [low, high] = this.range.map((end) => this.toLine(end));
      const [first, last] = this.whole.map((end) => this.toLine(end));
      const step = Math.max(first - low, Math.min(last - high, part * (high - low)));
      this.show([low + step, high + step].map((x) => this.fromLine(x)));
    }

    show([low, high]) {
      const range = [Math.max(low, this.whole[0]), Math.min(high, this.whole[1])];
      if (!(range[1] > range[0])) return;
      this.range = range;
      this.linking = true;
      for (const plot of this.plots) plot.setScale("x", { min: range[0], max: range[1] });
      this.linking = false;
      this.tell();
    }

    tell() {
      if (!this.span) return;
      const { unit } = this.chart.x;
      const [low, high] = this.range.map(short);
      this.span.textContent = `${low} to ${high} ${unit}`;
    }

    draw() {
      for (const plot of this.plots) plot.destroy();
      const sync = uPlot.sync(this.chart.id);
      this.plots = this.chart.panels.map((panel, k) => {
        const plot = new uPlot(this.options(panel, k), this.columns(k), this.places[k]);
        sync.sub(plot);
        return plot;
      });
      if (!this.counts()) this.plots.forEach((plot) => this.legend(plot));
      this.show(this.range);
    }

    columns(k) {
      const { x, lines } = this.data[k];
      return [x, ...lines.map((line) => line.y)];
    }

    options(panel, k) {
      const { x, panels } = this.chart;
      const last = k === panels.length - 1 || this.counts();
      const unit = x.unit && `, ${x.unit}`;
      const text = { stroke: token("--faint"), font: "11px system-ui, sans-serif" };
      const lines = { grid: { stroke: token("--line"), width: 1 }, ticks: { stroke: token("--line") } };
      const names = this.counts()
        ? {
            splits: () => x.names.map((_, n) => n),
            values: (u, at) => at.map((n) => wrapped(x.names[n] ?? "")),
            size: 56,
          }
        : { size: last ? 36 : 14, values: (u, at) => at.map((t) => (last ? tick(t) : "")) };
      return {
        width: this.width(k),
        height: panel.height + (last ? 24 : 0),
        cursor: {
          sync: { key: this.chart.id, scales: ["x", null], filters: { pub: (type) => type.startsWith("mousemove") || type === "mouseleave" } },
          drag: { x: !this.counts(), y: false, setScale: true },
          points: { size: 6 },
        },
        scales: {
          x: { time: false, distr: x.logarithmic ? 3 : 1, range: (u, low, high) => (this.counts() ? this.whole : [low, high]) },
          y: { range: around(panel, this.data[k]) },
        },
        axes: [
          { ...text, ...lines, label: last && !this.counts() ? `${x.label}${unit}` : undefined, labelFont: text.font, labelSize: 14, gap: 3, ...names },
          { ...text, ...lines, size: 56, space: panel.height < 150 ? 16 : 26, values: (u, at) => at.map(tick) },
        ],
        series: [
          { label: x.label, value: (u, v) => `${short(v)} ${x.unit}` },
          ...panel.lines.map((line, n) => this.series(line, this.shown[k][n])),
        ],
        plugins: [extras(panel, this.data[k])],
        hooks: { setScale: [(u, key) => this.follow(u, key)] },
        legend: {
          show: !this.counts(),
          live: true,
          markers: { width: 2, dash: (u, n) => (u.series[n].dash ? "dashed" : "solid") },
        },
      };
    }

    series(line, show) {
      const ink = sheet.inks[line.ink];
      const shared = { label: line.name, show, stroke: colour(ink), value: (u, v) => short(v), spanGaps: false };
      if (line.interval) {
        return { ...shared, paths: () => null, points: { show: true, size: 8, fill: colour(ink) } };
      }
      const dash = ink.dashes.length ? ink.dashes.map((part) => part * devicePixelRatio) : undefined;
      return { ...shared, width: ink.width, dash, points: { show: false } };
    }

    // A reader's drag on one panel moves the others.
    follow(u, key) {
      if (key !== "x" || this.linking) return;
      const { min, max } = u.scales.x;
      if (min === null || (min === this.range[0] && max === this.range[1])) return;
      this.show([min, max]);
    }

    // Names of lines are switches, for the keyboard too; a line goes in every panel at once.
    legend(plot) {
      const rows = plot.root.querySelectorAll(".u-legend .u-series");
      rows.forEach((row, n) => {
        const name = row.querySelector("th");
        if (n === 0) return;
        const toggle = () => this.toggle(plot.series[n].label, !plot.series[n].show);
        name.tabIndex = 0;
        name.setAttribute("role", "switch");
        name.setAttribute("aria-checked", String(plot.series[n].show));
        name.addEventListener("click", (event) => (event.stopImmediatePropagation(), toggle()), true);
        name.addEventListener("keydown", (event) => {
          if (event.key !== "Enter" && event.key !== " ") return;
          event.preventDefault();
          event.stopPropagation();
          toggle();
        });
      });
    }

    toggle(label, show) {
      this.plots.forEach((plot, k) => {
        plot.series.forEach((series, n) => {
          if (n === 0 || series.label !== label) return;
          this.shown[k][n - 1] = show;
          plot.setSeries(n, { show });
          const names = plot.root.querySelectorAll(".u-legend .u-series th");
          names[n].setAttribute("aria-checked", String(show));
        });
      });
    }

    width(k) {
      const room = this.printing ? this.printing / (this.counts() ? 2 : 1) : this.places[k].clientWidth;
      return Math.max(200, room);
    }

    // Draws for a sheet of paper, so many px wide; 0 draws for the screen again.
    print(width) {
      this.printing = width;
      this.draw();
    }

    resize() {
      this.plots.forEach((plot, k) => {
        const width = this.width(k);
        if (plot.width !== width) plot.setSize({ width, height: plot.height });
      });
    }
  }

  const tick = (value) => (value === null ? "" : String(Number(value.toPrecision(6))).replace("-", "−"));

  function wrapped(name) {
    const words = name.split(" ");
    const middle = Math.ceil(words.length / 2);
    return [words.slice(0, middle).join(" "), words.slice(middle).join(" ")].filter(Boolean).join("\n");
  }

  const lively = [];

  async function start(figure) {
    try {
      const chart = new LiveChart(figure, charts.get(figure.dataset.chart));
      await chart.start();
      lively.push(chart);
    } catch (error) {
      figure.querySelector(".tools").textContent = "This browser cannot draw the chart; see the files below.";
      console.error(error);
    }
  }

  // Charts that come near are drawn at once: a long report opens at once. The others follow while the
  // browser has nothing else to do, so that paper and a capture of the whole page have them.
  function liven() {
    const waiting = new Set(document.querySelectorAll("figure[data-chart]"));
    const take = (figure) => {
      near.unobserve(figure);
      return waiting.delete(figure) ? start(figure) : Promise.resolve();
    };
    const near = new IntersectionObserver(
      (seen) => seen.filter((of) => of.isIntersecting).forEach((of) => take(of.target)),
      { rootMargin: "600px" },
    );
    for (const figure of waiting) near.observe(figure);
    const idle = window.requestIdleCallback ?? ((act) => setTimeout(act, 50));
    // What is folded has no width yet, and is drawn when it is opened.
    const next = () =>
      idle(async () => {
        const figure = [...waiting].find((one) => one.offsetParent !== null);
        if (!figure) return;
        await take(figure);
        next();
      });
    next();
  }

  // A table as a spreadsheet takes it.
  function copyable(scroll) {
    const table = scroll.querySelector("table");
    const caption = table && table.querySelector("caption:not(.hidden)");
    if (!caption) return;
    const button = document.createElement("button");
    button.type = "button";
    button.className = "copy";
    button.textContent = "Copy";
    button.setAttribute("aria-label", `Copy the table: ${caption.textContent}`);
    button.addEventListener("click", async () => {
      const rows = [...table.rows].map((row) => [...row.cells].map((cell) => cell.innerText.trim()).join("\t"));
      button.textContent = (await copied(rows.join("\n"))) ? "Copied" : "Select and copy by hand";
      setTimeout(() => (button.textContent = "Copy"), 2000);
    });
    caption.append(" ", button);
  }

  async function copied(text) {
    try {
      await navigator.clipboard.writeText(text);
      return true;
    } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      const done = document.execCommand("copy");
      area.remove();
      return done;
    }
  }

  // Details that are closed would be missing on paper, but for those that a page of its own leaves out.
  const onePage = () => root.classList.contains("one-page");
  const SHEET_PX = 640;
  addEventListener("beforeprint", () => {
    root.classList.add("on-paper");
    for (const part of document.querySelectorAll("details:not([open])")) {
      if (onePage()) break;
      part.open = true;
      part.dataset.reclose = "";
    }
    for (const chart of lively) if (!chart.figure.querySelector(".still")) chart.print(SHEET_PX);
  });
  addEventListener("afterprint", () => {
    root.classList.remove("on-paper");
    for (const part of document.querySelectorAll("details[data-reclose]")) {
      part.open = false;
      delete part.dataset.reclose;
    }
    for (const chart of lively) if (chart.printing) chart.print(0);
  });

  // The summary by itself, on one sheet; `#one-page` at the end of the address shows it, too.
  function summary() {
    const button = document.querySelector(".one-page-print");
    if (!button) return;
    const follow = () => root.classList.toggle("one-page", location.hash === "#one-page");
    button.hidden = false;
    button.addEventListener("click", () => {
      root.classList.add("one-page");
      print();
      follow();
    });
    addEventListener("hashchange", follow);
    follow();
  }

  // A link to a folded section opens it.
  function unfold() {
    const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const fold = target && target.querySelector(":scope > details.fold");
    if (fold) fold.open = true;
  }

  document.querySelector(".scriptless")?.remove();
  addEventListener("hashchange", unfold);
  unfold();
  summary();
  document.querySelectorAll(".scroll").forEach(copyable);
  liven();
})();
