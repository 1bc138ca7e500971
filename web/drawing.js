// The vehicle from above and from the side, with an arrow for the force of each thruster.
"use strict";

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== undefined && value !== null) made.setAttribute(key, value);
  }
  made.append(...children.filter((child) => child !== undefined && child !== null));
  return made;
}

function shape(name, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// Longer than this part of a newton in the plane of the picture, a force has an arrow.
const IN_PLANE = 0.15;

function view(vehicle, { title, right, down, towards, toScreen }) {
  const thrusters = vehicle.thruster.filter(({ wrench }) => wrench);
  const hull = vehicle.size_m ?? null;
  const points = thrusters.map(({ position_m }) => toScreen(position_m));
  const half = hull ? [hull[right] / 2, hull[down] / 2] : [0, 0];
  const reach = (k) => Math.max(half[k], ...points.map((point) => Math.abs(point[k])), 0.05);
  const scale = 70 / Math.max(reach(0), reach(1));
  const picture = shape("svg", { viewBox: "-110 -110 220 220", role: "img", "aria-label": title });
  const [w, h] = hull ? half.map((x) => x * scale) : [reach(0) * scale, reach(1) * scale];
  picture.append(shape("rect", { class: "hull", x: -w, y: -h, width: 2 * w, height: 2 * h, rx: Math.min(w, h) / 3 }));
  const [bx, by] = toScreen([1, 0, 0]);
  const bow = [bx * (w + 6), by * (h + 6)];
  picture.append(shape("path", {
    class: "bow", d: bx ? `M${bow[0]},-5 l8,5 l-8,5 z` : `M-5,${bow[1]} l5,-8 l5,8 z`,
  }));
  thrusters.forEach(({ name, wrench }, k) => {
    const [x, y] = points[k].map((part) => part * scale);
    const force = wrench.slice(0, 3);
    const [dx, dy] = toScreen(force).map((part) => part * 32);
    const length = Math.hypot(dx, dy);
    const group = shape("g", {}, shape("title", {}, `${name}: ${vehicle.thruster.find((t) => t.name === name).moves}`));
    if (length > 32 * IN_PLANE) {
      const [ux, uy] = [dx / length, dy / length];
      const tip = [x + dx, y + dy];
      const side = [-uy * 4, ux * 4];
      const foot = [tip[0] - ux * 8, tip[1] - uy * 8];
      group.append(
        shape("path", { class: "arrow", d: `M${x},${y} L${foot[0]},${foot[1]}` }),
        shape("path", { class: "head", d: `M${tip} L${foot[0] + side[0]},${foot[1] + side[1]} L${foot[0] - side[0]},${foot[1] - side[1]} z` }),
      );
    } else {
      // Towards the reader a point, away from the reader a cross, as of an arrow.
      group.append(shape("circle", { class: "arrow", cx: x, cy: y, r: 6 }));
      if (force[towards[0]] * towards[1] > 0) group.append(shape("circle", { class: "head", cx: x, cy: y, r: 2 }));
      else group.append(shape("path", { class: "arrow", d: `M${x - 4},${y - 4} l8,8 M${x + 4},${y - 4} l-8,8` }));
    }
    // By its number: names would cover each other.
    group.append(shape("text", { x: x + 7, y: y + (k % 2 ? 12 : -7) }, String(vehicle.thruster.findIndex((t) => t.name === name) + 1)));
    picture.append(group);
  });
  return element("figure", {}, picture, element("figcaption", {}, title));
}

const VIEWS = [
  {
    title: "From above, bow up, starboard to the right",
    right: 1, down: 0, towards: [2, -1], toScreen: ([x, y]) => [y, -x],
  },
  {
    title: "From starboard, bow to the right",
    right: 0, down: 2, towards: [1, 1], toScreen: ([x, , z]) => [x, z],
  },
];

function drawn(vehicle) {
  return VIEWS.map((of) => view(vehicle, of));
}
