// Edits single keys of a TOML text and leaves all else, comments too, as it is.
"use strict";

// A text as TOML has it between quotation marks.
function quoted(text) {
  const named = { '"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t" };
  const escape = (c) => named[c] ?? `\\u${c.charCodeAt(0).toString(16).padStart(4, "0")}`;
  return `"${text.replace(/["\\\u0000-\u001f\u007f]/g, escape)}"`;
}

const isHeader = (line) => /^\s*\[/.test(line);

// The lines of a block, from its header to the next: the keys before all headers, a table such as
// `[sensor.dvl]`, or the entry of a list of tables that has a name.
function block(lines, header, name) {
  const end = (from) => {
    const next = lines.findIndex((line, k) => k >= from && isHeader(line));
    return next < 0 ? lines.length : next;
  };
  if (!header) return [0, end(0)];
  for (let k = 0; k < lines.length; k++) {
    if (lines[k].replace(/#.*/, "").trim() !== header) continue;
    const last = end(k + 1);
    const names = lines.slice(k + 1, last).map((line) => /^\s*name\s*=\s*(.*)/.exec(line)?.[1]);
    const isIt = (text) => text?.startsWith(quoted(name)) || text?.startsWith(`'${name}'`);
    if (name === undefined || names.some(isIt)) return [k + 1, last];
  }
  return null;
}

// Whether a value ends on its own line.
function isWhole(value) {
  const bare = value.replace(/"(\\.|[^"\\])*"|'[^']*'/g, "").replace(/#.*/, "");
  const count = (c) => bare.split(c).length;
  return count("[") === count("]") && count("{") === count("}") && !/"""|'''/.test(value);
}

// The text with a key set, in a block that is added at the end if it is not there; `null` if the key
// has a value over several lines.
function withKey(text, { header, name }, key, value) {
  const lines = text.replace(/\r\n/g, "\n").split("\n");
  let range = block(lines, header, name);
  if (range === null) {
    while (lines.at(-1)?.trim() === "") lines.pop();
    lines.push("", header, ...(name === undefined ? [] : [`name = ${quoted(name)}`]), "");
    range = [lines.length - 1, lines.length - 1];
  }
  const [from, to] = range;
  const sets = new RegExp(`^\\s*${key}\\s*=(.*)`);
  const hints = new RegExp(`^\\s*#\\s*${key}\\s*=`);
  const within = (pattern) => {
    const k = lines.slice(from, to).findIndex((line) => pattern.test(line));
    return k < 0 ? -1 : from + k;
  };
  const set = within(sets);
  if (set >= 0 && !isWhole(sets.exec(lines[set])[1])) return null;
  const at = set >= 0 ? set : within(hints);
  const line = `${key} = ${value}`;
  if (value === null) {
    if (set >= 0) lines.splice(set, 1);
  } else if (at >= 0) {
    lines[at] = line;
  } else {
    const named = within(/^\s*name\s*=/);
    lines.splice(named >= 0 ? named + 1 : from, 0, line);
  }
  return lines.join("\n");
}

// The text with other trials in place of its own.
function withTrials(text, trials) {
  const lines = text.replace(/\r\n/g, "\n").split("\n");
  const kept = [];
  let first = -1;
  let isTrial = false;
  for (const line of lines) {
    if (isHeader(line)) isTrial = /^\s*\[\[\s*trial\s*\]\]|^\s*\[\s*trial\./.test(line);
    if (isTrial && first < 0) first = kept.length;
    if (!isTrial) kept.push(line);
  }
  if (first < 0) {
    const header = kept.findIndex(isHeader);
    first = header < 0 ? kept.length : header;
  }
  const entry = ({ name, logs, dof, role, from, to }) => [
    "[[trial]]",
    `name = ${quoted(name)}`,
    `log = [${logs.map(quoted).join(", ")}]`,
    ...(dof ? [`dof = [${quoted(dof)}]`] : []),
    `role = ${quoted(role)}`,
    `from_s = ${from.toFixed(2)}`,
    `to_s = ${to.toFixed(2)}`,
    "",
  ];
  kept.splice(first, 0, ...trials.flatMap(entry));
  return kept.join("\n");
}
