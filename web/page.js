// The page: what was chosen, what the program says of it, what the user adds.
"use strict";

const byId = (id) => document.getElementById(id);
const NAMES = { vehicle: "vehicle.toml", campaign: "campaign.toml" };
const PRESETS = [["bluerov2", "BlueROV2"], ["bluerov2-heavy", "BlueROV2 Heavy"]];
// Published vehicles whose tables have thrusters.
const PUBLISHED = ["bluerov2-heavy-von-benzon-2022", "otter-mss", "rexrov", "wam-v-vrx"];
const FORMATS = ["c", "rust", "python", "casadi", "octave", "fmu", "gazebo", "uuv-simulator", "stonefish", "ros2", "json"];
const AXES = ["", "surge", "sway", "heave", "roll", "pitch", "yaw"];
const ROLES = ["fit", "hold-out", "steady"];
// As many channels stand in one table and on one chart.
const MOST_ROWS = 500;
const MOST_DRAWN = 60;

// --- The program in its worker.

const program = {
  jobs: new Map(),
  next: 0,

  start() {
    const address = URL.createObjectURL(new Blob([byId("worker").textContent], { type: "text/javascript" }));
    this.worker = new Worker(address);
    this.worker.onmessage = ({ data }) => this.hear(data);
    this.worker.onerror = (event) => this.fail(event.message || "the program could not be started");
    // Compiled once: after a stop the next worker gets the module as it is.
    this.worker.postMessage({ program: this.module ?? byId("program").textContent });
  },

  hear({ ready, id, progress, done, failed }) {
    if (ready) {
      this.module = ready;
      // After a stop, what it says stays.
      if (!this.wasReady) say("Ready.");
      this.wasReady = true;
      return;
    }
    const job = this.jobs.get(id);
    if (id === undefined && failed) return this.fail(failed);
    if (progress) return job?.watch(progress);
    this.jobs.delete(id);
    if (failed) job?.reject(new Error(failed));
    else job?.resolve(done);
  },

  fail(reason) {
    for (const job of this.jobs.values()) job.reject(new Error(reason));
    this.jobs.clear();
    complain(reason);
  },

  run(job, watch = () => {}) {
    const id = ++this.next;
    return new Promise((resolve, reject) => {
      this.jobs.set(id, { resolve, reject, watch });
      this.worker.postMessage({ id, collect: [], ...job });
    });
  },

  stop() {
    this.worker.terminate();
    for (const job of this.jobs.values()) job.reject(new Stopped());
    this.jobs.clear();
    this.start();
  },
};

class Stopped extends Error {}

// --- What is said.

// Shows a text and has it read aloud.
function say(text) {
  byId("message").textContent = text;
  announce(text);
}

let announced = 0;

function announce(text) {
  announced = performance.now();
  byId("announced").textContent = text;
}

// Progress is read aloud no more often than this, ms.
const ANNOUNCED_EVERY = 15000;

// Shows how far a job is; reads it aloud now and then.
function progressed(text) {
  byId("message").textContent = text;
  if (performance.now() - announced > ANNOUNCED_EVERY) announce(text);
}

function complain(text) {
  byId("error").textContent = text;
  byId("error").hidden = !text;
}

const megabytes = (bytes) => `${(bytes / 1e6).toPrecision(3)} MB`;

function spoken(seconds) {
  if (seconds < 90) return `${Math.max(1, Math.round(seconds))} s`;
  return `${Math.round(seconds / 60)} min`;
}

// What the program says of an error, without the words that shells need.
function reason({ said, broken, reading }) {
  const lines = said.split("\n").filter((line) => line && !line.startsWith('{"axes"'));
  let text = lines.join("\n");
  try {
    text = JSON.parse(text).error ?? text;
  } catch {
    text = text.replace(/^error: /, "");
  }
  const which = reading ? `${reading}: ` : "";
  if (/memory allocation of|out of memory/i.test(said)) {
    return `${which}this needs more memory than a browser gives a page (4 GB). Cut the log, choose fewer logs at once, or use the program.`;
  }
  return broken ? `${which}the program gave up: the file is damaged in a way that it does not expect. Remove it, and go on with the others.\n${text}` : text;
}

let busy = false;

// Does a job under the eyes of the user, who may stop it; `null` if it was stopped or failed.
async function watched(what, job) {
  if (busy) {
    complain("One thing at a time: wait for what is running, or stop it.");
    return null;
  }
  busy = true;
  complain("");
  say(`${what} …`);
  const bar = byId("progress");
  bar.removeAttribute("value");
  byId("running").hidden = false;
  const start = performance.now();
  const seconds = () => (performance.now() - start) / 1000;
  let detail = "";
  let until = null;
  const tick = setInterval(() => {
    const left = until === null ? "" : `, about ${spoken(Math.max(1, until - seconds()))} left`;
    progressed(`${what}: ${detail}${spoken(seconds())} so far${left}`);
  }, 1000);
  const watch = ({ read, total, fit, command, number, of }) => {
    if (total) {
      bar.value = Math.min(1, read / total);
      detail = `${megabytes(Math.min(read, total))} of ${megabytes(total)} read, `;
    } else if (fit) {
      bar.value = fit.done / fit.of;
      detail = `fit ${fit.done + 1} of ${fit.of}, ${fit.axes.join(", ")} by ${fit.method}, `;
      // The estimate counts on a processor that runs the program itself; later fits correct it.
      until = seconds() + Math.sqrt(Math.max(fit.left_s[0], 1) * Math.max(fit.left_s[1], 1));
      progressed(`${what}: ${detail}about ${spoken(until - seconds())} left`);
    } else if (of > 1) {
      bar.value = (number - 1) / of;
      detail = `${command} ${number} of ${of}, `;
    }
  };
  try {
    const done = await program.run(job, watch);
    say(`${what}: done in ${spoken(seconds())}.`);
    return done;
  } catch (error) {
    if (error instanceof Stopped) say(`${what}: stopped. What you wrote and marked is kept.`);
    else {
      say(`${what}: failed.`);
      complain(error.message);
    }
    return null;
  } finally {
    clearInterval(tick);
    busy = false;
    byId("running").hidden = true;
  }
}

// --- Files.

const chosen = new Map();
let inspection = null;
// The logs that were inspected, as the chart and the marks on it have them.
let looked = [];
let marks = [];
let results = null;

// The folder that the program sees: what was chosen, and both texts as they are now.
function files() {
  const all = [...chosen].map(([path, file]) => ({ path, ...file }));
  for (const [id, path] of Object.entries(NAMES)) {
    if (byId(id).value.trim()) all.push({ path, text: byId(id).value });
  }
  return all;
}

// Logs that are ticked: those that are looked at, and that both files are proposed from.
const logs = () => [...chosen].filter(([, { ticked }]) => ticked).map(([path]) => path);

// More logs than this are more than one trial: the user ticks those of one.
const MOST_TICKED = 4;

// A path within the folder: no step leads out of it, and none is hidden.
function inside(path) {
  const walked = path.replace(/\\/g, "/").split("/").filter((step) => step && step !== "." && step !== "..");
  return walked.join("/").replace(/^-+/, "_") || "file";
}

async function add(list) {
  const ticked = list.filter(([path]) => !path.endsWith(".toml")).length <= MOST_TICKED;
  for (const [path, file] of list) {
    const name = inside(path);
    const last = name.split("/").at(-1).toLowerCase();
    const id = Object.keys(NAMES).find((key) => NAMES[key] === last);
    if (id) {
      byId(id).value = await file.text();
      remember();
    } else {
      chosen.set(name, { file, ticked: ticked && !name.endsWith(".toml") });
    }
  }
  showChosen();
  await look();
  await showVehicle();
}

function showChosen() {
  const items = [...chosen].map(([path, entry]) => {
    const tick = element("input", {
      type: "checkbox", checked: entry.ticked === true,
      onchange: ({ target }) => {
        entry.ticked = target.checked;
        showTicked();
      },
    });
    const remove = element("button", {
      type: "button", class: "quiet", "aria-label": `Remove ${path}`,
      onclick: () => {
        chosen.delete(path);
        showChosen();
        look();
      },
    }, "remove");
    const size = megabytes(entry.file?.size ?? entry.bytes.length);
    return element("li", {}, element("label", {}, tick, ` ${path} (${size}) `), remove);
  });
  byId("chosen").replaceChildren(...items);
  showTicked();
}

function showTicked() {
  byId("inspect").hidden = chosen.size === 0;
  byId("look").disabled = logs().length === 0;
  byId("propose").disabled = logs().length === 0;
}

// What the logs hold.
async function look() {
  inspection = null;
  byId("inspected").hidden = true;
  byId("chart").hidden = true;
  const names = logs();
  if (names.length === 0) return;
  looked = names;
  const done = await watched("Reading the logs", { files: files(), commands: [["inspect", "--json", ...names]] });
  if (!done) return;
  const [result] = done.results;
  if (result.code !== 0) return complain(reason(result));
  inspection = JSON.parse(result.printed);
  showInspection();
}

function number(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return String(Number(value.toPrecision(5))).replace("-", "−");
}

function showInspection() {
  const several = inspection.files.length > 1;
  const lines = inspection.files.map(({ path, format, span_s, surveyed }) => {
    const lasts = span_s ? `, ${number(span_s[1] - span_s[0])} s` : "";
    const part = surveyed ? "; a survey of parts, so that numbers are estimates and gaps are not counted" : "";
    return element("p", {}, element("strong", {}, path), `: ${format}${lasts}${part}`);
  });
  const notes = inspection.notes.map((note) => element("p", { class: "note-care" }, `Note: ${note}`));
  byId("remarks").replaceChildren(...lines, ...notes);
  const start = Object.fromEntries(inspection.files.map(({ path, span_s }) => [path, span_s?.[0] ?? 0]));
  const heads = [...(several ? ["File"] : []), "Column", "Unit", "Samples", "Hz", "From, s", "To, s", "Gaps", "Least", "Most", "Remarks"];
  const shown = wanted();
  const rows = shown.slice(0, MOST_ROWS).map((channel) => {
    const cell = (text) => element("td", { class: "number" }, text);
    const late = start[channel.file];
    return element("tr", {},
      ...(several ? [element("td", {}, channel.file)] : []),
      element("th", { scope: "row" }, channel.column),
      element("td", {}, channel.unit ?? "not stated"),
      cell(String(channel.count)), cell(number(channel.rate_hz)),
      cell(number(channel.first_s - late)), cell(number(channel.last_s - late)),
      cell(channel.gaps ?? "–"), cell(number(channel.min)), cell(number(channel.max)),
      element("td", { class: "remark" }, channel.remarks.join("; ")));
  });
  const more = shown.length - rows.length;
  byId("channels").replaceChildren(
    element("caption", {}, `${shown.length} of ${inspection.channels.length} columns${more > 0 ? `; the first ${MOST_ROWS} are shown` : ""}`),
    element("thead", {}, element("tr", {}, ...heads.map((head) => element("th", { scope: "col" }, head)))),
    element("tbody", {}, ...rows));
  byId("inspected").hidden = false;
}

function wanted() {
  const text = byId("filter").value.toLowerCase();
  return (inspection?.channels ?? []).filter(({ column }) => column.toLowerCase().includes(text));
}

// --- The chart, and trials that are marked on it.

// A page of the program's own: it runs the scripts that the policy names, offers its tables and prints.
function framed(title, bytes) {
  const frame = element("iframe", { title, sandbox: "allow-scripts allow-downloads allow-modals" });
  frame.srcdoc = new TextDecoder().decode(bytes);
  return frame;
}

async function draw() {
  const columns = wanted().filter(({ min, max }) => min !== max);
  if (columns.length === 0) return complain("None of these columns varies; there is nothing to draw.");
  if (columns.length > MOST_DRAWN) {
    return complain(`${columns.length} columns vary, and a chart shows ${MOST_DRAWN}: narrow them down by a part of their names, such as ATT or velocity.`);
  }
  const only = columns.flatMap(({ column }) => ["--only", column]);
  const narrowed = byId("filter").value ? only : [];
  const words = ["plot", "--out", "chart.html", ...narrowed, "--", ...looked];
  const done = await watched("Drawing", { files: files(), commands: [words], collect: ["chart.html"] });
  if (!done) return;
  if (done.results[0].code !== 0) return complain(reason(done.results[0]));
  byId("chart").replaceChildren(framed("Channels over time", done.left[0].bytes));
  byId("chart").hidden = false;
}

addEventListener("message", ({ source, data }) => {
  if (source !== byId("chart").querySelector("iframe")?.contentWindow) return;
  if (!Array.isArray(data?.marks)) return;
  const stretches = data.marks.filter((mark) => Array.isArray(mark) && mark.length === 2 && mark.every(Number.isFinite));
  marks = stretches.map(([from, to], k) => ({ dof: "surge", role: "fit", ...marks[k], from, to }));
  showMarks();
  remember();
});

function choice(label, values, value, change) {
  const options = values.map((each) => element("option", { value: each, selected: each === value }, each || "several at once"));
  return element("select", { "aria-label": label, onchange: ({ target }) => change(target.value) }, ...options);
}

function showMarks() {
  byId("marked").hidden = marks.length === 0;
  const rows = marks.map((mark, k) => {
    const set = (key) => (value) => {
      mark[key] = value;
      remember();
    };
    return element("tr", {},
      element("th", { scope: "row" }, `trial ${k + 1}`),
      element("td", { class: "number" }, `${mark.from.toFixed(1)} to ${mark.to.toFixed(1)} s`),
      element("td", {}, choice(`Axis of trial ${k + 1}`, AXES, mark.dof, set("dof"))),
      element("td", {}, choice(`Role of trial ${k + 1}`, ROLES, mark.role, set("role"))));
  });
  const heads = ["Trial", "From and to", "Axis", "Role"];
  byId("marks").replaceChildren(
    element("thead", {}, element("tr", {}, ...heads.map((head) => element("th", { scope: "col" }, head)))),
    element("tbody", {}, ...rows));
}

function useMarks() {
  if (looked.length === 0) return complain("Choose the logs again first: the marks are on them, and a browser does not keep them.");
  const trials = marks.map((mark, k) => ({ ...mark, name: `trial ${k + 1}`, logs: looked }));
  byId("campaign").value = withTrials(byId("campaign").value, trials);
  remember();
  say(`${trials.length} trials are written into campaign.toml.`);
  byId("campaign").focus();
}

// --- Both files.

async function propose() {
  const wanted = byId("preset").value;
  const [kind, name] = wanted.split(":");
  const preset = kind === "preset" ? ["--preset", name] : [];
  const commands = [["init", "--json", "--out", "proposed", ...preset, "--", ...logs()]];
  const all = files().filter(({ path }) => path !== "twin.toml");
  if (kind === "published") {
    all.push({ path: "twin.toml", text: `vehicle = ${quoted(wanted)}\n` });
    commands.push(["twin", "twin.toml", "--out", "published", "--quiet"]);
  }
  const done = await watched("Proposing", { files: all, commands, collect: ["proposed", "published/vehicle.toml"] });
  if (!done) return;
  const [result] = done.results;
  if (result.code !== 0) return complain(reason(result));
  const left = Object.fromEntries(done.left.map(({ path, bytes }) => [path, new TextDecoder().decode(bytes)]));
  byId("vehicle").value = left["published/vehicle.toml"] ?? left["proposed/vehicle.toml"];
  // The proposal lies a folder deeper than its logs.
  byId("campaign").value = left["proposed/campaign.toml"].replaceAll('"../', '"');
  const open = JSON.parse(result.printed).open_questions;
  const items = open.map((question) => element("li", {}, question));
  byId("questions").replaceChildren(...(items.length ? [element("p", {}, "To decide before the fit:"), element("ul", {}, ...items)] : []));
  remember();
  await showVehicle();
}

const SENSORS = { dvl: "DVL", depth: "Depth sensor", attitude: "Attitude sensor", position: "Antenna, beacon or marker", imu: "Accelerometer" };

// Draws the vehicle as the program reads it, and fills the form.
async function showVehicle() {
  if (!byId("vehicle").value.trim()) return;
  let done;
  try {
    done = await program.run({ files: files(), commands: [["vehicle", "--json", NAMES.vehicle]] });
  } catch {
    return;
  }
  const [result] = done.results;
  if (result.code !== 0) {
    byId("missing").textContent = reason(result);
    byId("drawing").replaceChildren();
    return;
  }
  const vehicle = JSON.parse(result.printed);
  byId("missing").textContent = vehicle.missing ? `Still missing: ${vehicle.missing}` : "";
  byId("drawing").replaceChildren(...drawn(vehicle));
  const focused = document.activeElement?.id;
  byId("form").replaceChildren(...fields(vehicle));
  if (focused) byId(focused)?.focus();
}

function setKey(place, key, value) {
  const text = withKey(byId("vehicle").value, place, key, value);
  if (text === null) return complain(`${key} is written over several lines; change it in vehicle.toml.`);
  complain("");
  byId("vehicle").value = text;
  remember();
  showVehicle();
}

let unnamed = 0;

function labelled(label, input) {
  input.id = `field-${++unnamed}`;
  return [element("label", { for: input.id }, label), input];
}

// A number, or as many as a vector has; the key goes when all are empty.
function numbers(place, key, label, units, values, write = (list) => `[${list.join(", ")}]`) {
  const inputs = units.map((unit, k) => element("input", {
    type: "number", step: "any", value: values?.[k] ?? "", "aria-label": `${label}, ${unit}`,
    id: `field-${place.header ?? ""}-${place.name ?? ""}-${key}-${k}`,
    onchange: () => {
      const texts = inputs.map((input) => input.value);
      if (texts.every((text) => text === "")) return setKey(place, key, null);
      if (texts.some((text) => text === "")) return say(`${label}: give every number, ${units.join(", ")}.`);
      setKey(place, key, write(texts.map(Number)));
    },
  }));
  return element("div", { class: "row", role: "group", "aria-label": label }, element("span", {}, label), ...inputs);
}

const AXES_M = ["x forward, m", "y starboard, m", "z down, m"];

function fields(vehicle) {
  unnamed = 0;
  const one = (list) => String(list[0]);
  const name = element("input", { class: "text", value: vehicle.name ?? "", onchange: ({ target }) => setKey({}, "name", quoted(target.value)) });
  const size = ["length, m", "width, m", "height, m"];
  const whole = element("fieldset", {}, element("legend", {}, "Vehicle"),
    element("div", { class: "row" }, ...labelled("Name", name)),
    numbers({}, "dry_mass_kg", "Mass in air, kg", ["kg"], [vehicle.dry_mass_kg], one),
    numbers({}, "size_m", "Hull: length, width, height, m", size, vehicle.size_m));
  const thrusters = vehicle.thruster.map((thruster, k) => {
    const place = { header: "[[thruster]]", name: thruster.name };
    const reversed = element("input", { type: "checkbox", checked: thruster.reversed === true, onchange: ({ target }) => setKey(place, "reversed", String(target.checked)) });
    const curve = element("input", {
      class: "text", list: "curves", placeholder: thruster.curve || vehicle.thruster_curve ? "as the file has it" : "not given",
      onchange: ({ target }) => target.value && setKey(place, "curve", target.value),
    });
    return element("fieldset", {}, element("legend", {}, `${k + 1}: ${thruster.name}`),
      element("p", { class: "moves" }, thruster.moves ? `1 N at positive input: ${thruster.moves}` : "Position or direction is missing."),
      numbers(place, "position_m", "Position x, y, z, m", AXES_M, thruster.position_m),
      numbers(place, "direction", "Direction forward, starboard, down", ["forward", "starboard", "down"], thruster.direction),
      element("div", { class: "row" }, ...labelled("Reversed", reversed)),
      element("div", { class: "row" }, ...labelled("Curve", curve)));
  });
  const sensors = Object.entries(SENSORS).map(([key, label]) => {
    const place = { header: `[sensor.${key}]` };
    const sensor = vehicle.sensor?.[key] ?? {};
    const parts = [];
    if (key !== "attitude") parts.push(numbers(place, "position_m", `${label}: position x, y, z, m`, AXES_M, sensor.position_m));
    if (["dvl", "attitude", "imu"].includes(key)) parts.push(numbers(place, "rotation_deg", `${label}: roll, pitch, yaw, deg`, ["roll, deg", "pitch, deg", "yaw, deg"], sensor.rotation_deg));
    return parts;
  });
  const curves = [
    '{ kind = "preset", name = "t200", voltage_v = 16.0 }',
    '{ kind = "quadratic", input = "pwm", forward = 3e-4, reverse = 2.4e-4, deadband = 27.0 }',
    '{ kind = "quadratic", forward = 0.04, reverse = 0.03 }',
    '{ kind = "table", input = "pwm", file = "thruster.csv" }',
  ];
  return [whole, ...thrusters,
    element("fieldset", {}, element("legend", {}, "Sensors"), ...sensors.flat()),
    element("datalist", { id: "curves" }, ...curves.map((value) => element("option", { value })))];
}

// --- Fits.

async function identify() {
  if (!byId("campaign").value.trim()) return complain("There is no campaign.toml yet: choose logs and let both files be proposed, or drop yours.");
  const words = ["identify", NAMES.campaign, "--out", "results", "--progress-json"];
  const done = await watched("Identifying", { files: files(), commands: [words], collect: ["results"] });
  if (done) showResults(done, "results/");
}

async function demo() {
  if (chosen.size > 0 && !confirm("The demo takes the place of the logs and files that you have here. Go on?")) return;
  const words = ["demo", "--out", "demo", "--progress-json"];
  const done = await watched("Demo", { files: [], commands: [words], collect: ["demo"] });
  if (!done) return;
  chosen.clear();
  marks = [];
  showMarks();
  for (const { path, bytes } of done.left) {
    const name = path.slice("demo/".length);
    const id = Object.keys(NAMES).find((key) => NAMES[key] === name);
    if (id) byId(id).value = new TextDecoder().decode(bytes);
    else if (name.startsWith("logs/")) chosen.set(name, { bytes: bytes.slice() });
    else if (name === "bollard-pull.csv") chosen.set(name, { bytes: bytes.slice() });
  }
  showChosen();
  remember();
  showResults(done, "demo/");
  await showVehicle();
}

function showResults({ results: [result], left }, folder) {
  const made = left.filter(({ path }) => !/^demo\/(logs\/|vehicle.toml|campaign.toml|bollard-pull.csv)/.test(path));
  results = new Map(made.map(({ path, bytes }) => [path.slice(folder.length), bytes]));
  const report = results.get("report.html");
  byId("result").hidden = report === undefined;
  if (result.code !== 0) complain(reason(result));
  if (report === undefined) return;
  byId("summary").textContent = result.printed;
  byId("refused").replaceChildren();
  byId("report").replaceChildren(framed("The report", report));
  byId("result-title").tabIndex = -1;
  byId("result-title").focus();
  byId("result").scrollIntoView();
}

async function exportAll() {
  const input = { path: "results.json", bytes: results.get("results.json") };
  const commands = FORMATS.map((format) => ["export", "results.json", "--to", format, "--out", `exports/${format}`]);
  const done = await watched("Exporting", { files: [input], commands, collect: ["exports"] });
  if (!done) return;
  const refused = done.results.map((result, k) => (result.code === 0 ? null : `${FORMATS[k]}: ${reason(result)}`));
  const items = refused.filter(Boolean).map((text) => element("li", {}, text));
  byId("refused").replaceChildren(...items);
  if (done.left.length > 0) save("exports.zip", zipped(done.left));
}

// --- Downloads, and what is kept when the tab closes.

function save(name, content) {
  const link = element("a", { download: name });
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content]));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

const KEPT = "seaplant";

function remember() {
  const kept = { vehicle: byId("vehicle").value, campaign: byId("campaign").value, marks };
  try {
    localStorage.setItem(KEPT, JSON.stringify(kept));
  } catch {
    // A browser that keeps nothing keeps nothing.
  }
}

function recall() {
  let kept;
  try {
    kept = JSON.parse(localStorage.getItem(KEPT));
  } catch {
    return;
  }
  if (!kept || !(kept.vehicle || kept.campaign || kept.marks?.length)) return;
  byId("vehicle").value = kept.vehicle ?? "";
  byId("campaign").value = kept.campaign ?? "";
  marks = (kept.marks ?? []).filter(({ from, to }) => Number.isFinite(from) && Number.isFinite(to));
  showMarks();
  const forget = element("button", {
    type: "button", class: "quiet",
    onclick: () => {
      localStorage.removeItem(KEPT);
      location.reload();
    },
  }, "Forget them");
  byId("questions").replaceChildren(element("p", {}, "vehicle.toml, campaign.toml and marks are as you left them; choose the logs again. ", forget));
}

// Files below what was dropped, with their paths.
async function dropped(items) {
  const found = [];
  const walk = async (entry, path) => {
    if (entry.isFile) {
      found.push([path, await new Promise((resolve, reject) => entry.file(resolve, reject))]);
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (entries.length === 0) return;
      for (const inner of entries) await walk(inner, `${path}/${inner.name}`);
    }
  };
  // All at once: the list is empty after the first wait.
  const entries = [...items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  for (const entry of entries) {
    // What lies in one dropped folder is named from within it, as its campaign names it.
    if (entry.isDirectory && entries.length === 1) {
      const before = found.length;
      await walk(entry, entry.name);
      for (const file of found.slice(before)) file[0] = file[0].slice(entry.name.length + 1);
    } else {
      await walk(entry, entry.name);
    }
  }
  return found;
}

function listen() {
  const drop = byId("drop");
  for (const kind of ["dragenter", "dragover", "dragleave", "drop"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      drop.classList.toggle("over", kind === "dragenter" || kind === "dragover");
    });
  }
  document.addEventListener("drop", async ({ dataTransfer }) => {
    try {
      await add(await dropped(dataTransfer.items));
    } catch (error) {
      complain(`What was dropped cannot be read: ${error.message}`);
    }
  });
  byId("files").addEventListener("change", async ({ target }) => {
    const list = [...target.files].map((file) => [file.webkitRelativePath || file.name, file]);
    target.value = "";
    await add(list);
  });
  byId("folder").addEventListener("change", async ({ target }) => {
    // Paths as from within the folder, as its campaign has them.
    const list = [...target.files].map((file) => [file.webkitRelativePath.replace(/^[^/]*\//, ""), file]);
    target.value = "";
    await add(list);
  });
  byId("look").addEventListener("click", look);
  byId("filter").addEventListener("input", () => inspection && showInspection());
  byId("draw").addEventListener("click", draw);
  byId("use-marks").addEventListener("click", useMarks);
  byId("propose").addEventListener("click", propose);
  byId("identify").addEventListener("click", identify);
  byId("demo").addEventListener("click", demo);
  byId("stop").addEventListener("click", () => program.stop());
  byId("export").addEventListener("click", exportAll);
  byId("all").addEventListener("click", () => {
    save("results.zip", zipped([...results].map(([path, bytes]) => ({ path: `results/${path}`, bytes }))));
  });
  for (const button of document.querySelectorAll("[data-save]")) {
    const id = button.dataset.save;
    button.addEventListener("click", () => save(NAMES[id], byId(id).value));
  }
  for (const button of document.querySelectorAll("[data-get]")) {
    button.addEventListener("click", () => save(button.dataset.get, results.get(button.dataset.get)));
  }
  let wait;
  for (const id of Object.keys(NAMES)) {
    byId(id).addEventListener("input", () => {
      remember();
      clearTimeout(wait);
      if (id === "vehicle") wait = setTimeout(showVehicle, 600);
    });
  }
  addEventListener("beforeunload", (event) => busy && event.preventDefault());
}

for (const [name, title] of PRESETS) byId("preset").append(element("option", { value: `preset:${name}` }, title));
for (const name of PUBLISHED) byId("preset").append(element("option", { value: `published:${name}` }, `published: ${name}`));
listen();
recall();
// The worker and the program follow this script.
addEventListener("DOMContentLoaded", () => {
  program.start();
  showVehicle();
});
