// What the keys of a gauge mean in the picture: which lines show it, which points are dragged. Keys have meanings, and
// kinds are what they have of them: nothing here knows a kind.
const RAD = Math.PI / 180, ARROW_PX = 20, ROUND = 10;
const tenth = (value) => Math.round(value * ROUND) / ROUND;
const num = (table, key, other = 0) => (Number.isFinite(table[key]) ? table[key] : other);
const turned = (angle) => [Math.cos(angle * RAD), Math.sin(angle * RAD)];
const degrees = (dx, dy) => tenth(Math.atan2(dy, dx) / RAD);

// Unit vectors along what is measured (or along a line), and across.
function axes(table) {
  const along = turned("angle_deg" in table ? num(table, "angle_deg") : num(table, "direction_deg"));
  return { along, across: [-along[1], along[0]] };
}
const from = (table, [a, b], length) => [num(table, "x_px") + a * length, num(table, "y_px") + b * length];
const box = (table, width, height) => [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].map(([a, b]) => [num(table, "x_px") + a * width / 2, num(table, "y_px") + b * height / 2]);
const bar = (middle, [a, b], length) => [[middle[0] - a * length / 2, middle[1] - b * length / 2], [middle[0] + a * length / 2, middle[1] + b * length / 2]];

// Polylines of [x, y] in the picture's pixels.
export function outline(table) {
  const { along, across } = axes(table), middle = from(table, along, 0), lines = [];
  if ("angle_deg" in table) lines.push(bar(middle, along, num(table, "length_px")));
  else if ("direction_deg" in table) {
    const half = num(table, "distance_px") / 2;
    for (const side of half ? [-half, half] : [0]) lines.push(bar(from(table, along, side), across, num(table, "length_px")));
    const tip = half || ARROW_PX;
    lines.push([from(table, along, half ? -half : 0), from(table, along, tip)]);
  }
  if ("diameter_px" in table) lines.push(Array.from({ length: 49 }, (_, i) => from(table, turned(i * 7.5), num(table, "diameter_px") / 2)));
  if ("width_px" in table) lines.push(box(table, num(table, "width_px"), num(table, "height_px")));
  if ("size_px" in table) lines.push(box(table, num(table, "size_px"), num(table, "size_px")));
  return lines;
}

// Points that are dragged: name and place.
export function handles(table) {
  const { along, across } = axes(table), found = [["middle", ...from(table, along, 0)]];
  if ("angle_deg" in table) found.push(["end", ...from(table, along, num(table, "length_px") / 2)]);
  else if ("direction_deg" in table) {
    found.push(["direction", ...from(table, along, num(table, "distance_px") / 2 || ARROW_PX)]);
    found.push(["length", ...from(table, across, num(table, "length_px") / 2)]);
  }
  if ("diameter_px" in table) found.push(["rim", ...from(table, [1, 0], num(table, "diameter_px") / 2)]);
  if ("width_px" in table) found.push(["corner", num(table, "x_px") + num(table, "width_px") / 2, num(table, "y_px") + num(table, "height_px") / 2]);
  if ("size_px" in table) found.push(["corner", num(table, "x_px") + num(table, "size_px") / 2, num(table, "y_px") + num(table, "size_px") / 2]);
  return found;
}

// Keys that a dragged point changes.
export function dragged(table, handle, x, y) {
  const dx = x - num(table, "x_px"), dy = y - num(table, "y_px"), far = tenth(2 * Math.hypot(dx, dy));
  if (handle === "middle") return { x_px: tenth(x), y_px: tenth(y) };
  if (handle === "end") return { angle_deg: degrees(dx, dy), length_px: far };
  if (handle === "direction") return "distance_px" in table ? { direction_deg: degrees(dx, dy), distance_px: far } : { direction_deg: degrees(dx, dy) };
  if (handle === "length") return { length_px: far };
  if (handle === "rim") return { diameter_px: far };
  const wide = tenth(2 * Math.abs(dx)), high = tenth(2 * Math.abs(dy));
  return "size_px" in table ? { size_px: Math.max(wide, high) } : { width_px: wide, height_px: high };
}

// A new gauge, dragged from one point to another: along a line, across edges, over a thing, from rim to rim.
export function drawn(usual, [x0, y0], [x1, y1]) {
  const length = tenth(Math.hypot(x1 - x0, y1 - y0)), table = { ...usual, x_px: tenth((x0 + x1) / 2), y_px: tenth((y0 + y1) / 2) };
  const set = (key, value) => { if (key in usual) table[key] = value; };
  set("angle_deg", degrees(x1 - x0, y1 - y0));
  set("direction_deg", degrees(x1 - x0, y1 - y0));
  set("distance_px", length);
  set("diameter_px", length);
  if ("angle_deg" in usual) set("length_px", length);
  set("width_px", tenth(Math.abs(x1 - x0)));
  set("height_px", tenth(Math.abs(y1 - y0)));
  set("size_px", tenth(Math.max(Math.abs(x1 - x0), Math.abs(y1 - y0))));
  return table;
}
