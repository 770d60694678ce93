// The charts as they are seen, drawn as lines and letters: each with its band, and a model beside it.
import { at, colour } from "/page/bus.js";
import { decimals } from "/page/axis_labels.js";

const WIDE = 900, LEFT = 70, RIGHT = 15, TOP = 34, BETWEEN = 22, FOOT = 44, TICKS = 6;
const escaped = (words) => words.replace(/[&<>]/g, (sign) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[sign]);
function ticks(low, high) {
  const least = (high - low) / TICKS, power = 10 ** Math.floor(Math.log10(least)), step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= least);
  const found = [];
  for (let at = Math.ceil(low / step) * step; at <= high + 1e-9 * step; at += step) found.push([at, at.toFixed(decimals(step))]);
  return found;
}
function limits(columns) {
  let low = Infinity, high = -Infinity;
  for (const column of columns) for (const value of column) if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
  if (low > high) return [0, 1];
  const room = 0.05 * (high - low) || 0.01;
  return [low - room, high + room];
}
// Pieces of a line between the places without a value.
function pieces(xs, ys) {
  const found = [];
  let open = null;
  ys.forEach((y, i) => {
    if (y === null) { open = null; return; }
    if (!open) { open = []; found.push(open); }
    open.push(`${xs[i].toFixed(2)},${y.toFixed(2)}`);
  });
  return found;
}
function panel(name, [times, value, low, high, model], [from, to], top, tall, stroke, label) {
  const [least, greatest] = limits([value, low, high, model || []]), x = (time) => LEFT + ((time - from) / (to - from)) * (WIDE - LEFT - RIGHT), y = (each) => (each === null ? null : top + tall - ((each - least) / (greatest - least)) * tall);
  const xs = times.map(x), lines = [], ink = colour("--ink"), grid = colour("--line");
  for (const [at, words] of ticks(least, greatest)) lines.push(`<path d="M${LEFT} ${y(at).toFixed(2)}H${WIDE - RIGHT}" stroke="${grid}"/><text x="${LEFT - 6}" y="${(y(at) + 4).toFixed(2)}" text-anchor="end">${words}</text>`);
  for (const [at] of ticks(from, to)) lines.push(`<path d="M${x(at).toFixed(2)} ${top}V${top + tall}" stroke="${grid}"/>`);
  const upper = pieces(xs, high.map(y)), lower = pieces(xs, low.map(y));
  upper.forEach((piece, i) => lines.push(`<polygon points="${[...piece, ...lower[i].slice().reverse()].join(" ")}" fill="${stroke}" fill-opacity="0.27"/>`));
  for (const piece of pieces(xs, value.map(y))) lines.push(`<polyline points="${piece.join(" ")}" fill="none" stroke="${stroke}" stroke-width="1.5"/>`);
  for (const piece of model ? pieces(xs, model.map(y)) : []) lines.push(`<polyline points="${piece.join(" ")}" fill="none" stroke="${colour("--model")}" stroke-width="1.5" stroke-dasharray="7 4"/>`);
  lines.push(`<rect x="${LEFT}" y="${top}" width="${WIDE - LEFT - RIGHT}" height="${tall}" fill="none" stroke="${ink}"/>`);
  lines.push(`<text transform="translate(16 ${top + tall / 2}) rotate(-90)" text-anchor="middle">${label}</text>`);
  return `<g id="${name}">${lines.join("")}</g>`;
}
// Panels under each other with one time axis: name, columns as the charts hold them, height, colour and label of each, and its
// failures; [from, to] are the times seen.
export function svg(title, panels, [from, to]) {
  const inside = (columns) => { const keep = columns[0].map((time) => time >= from && time <= to); return columns.map((column) => column.filter((_, i) => keep[i])); };
  const parts = [], x = (time) => LEFT + ((time - from) / (to - from)) * (WIDE - LEFT - RIGHT);
  let foot = TOP - BETWEEN;
  for (const { name, columns, high, stroke, label, failing } of panels) {
    parts.push(panel(name, inside(columns), [from, to], foot + BETWEEN, high, colour(stroke), escaped(label)));
    foot += BETWEEN + high;
    for (const run of failing) parts.push(`<rect x="${(x(run.from) - 1).toFixed(2)}" y="${foot - 8}" width="${Math.max(2, x(run.to) - x(run.from) + 2).toFixed(2)}" height="8" fill="${colour("--bad")}"><title>${escaped(run.status)}</title></rect>`);
  }
  for (const [at, words] of ticks(from, to)) parts.push(`<text x="${x(at).toFixed(2)}" y="${foot + 16}" text-anchor="middle">${words}</text>`);
  parts.push(`<text x="${(LEFT + WIDE - RIGHT) / 2}" y="${foot + 34}" text-anchor="middle">time (s)</text>`);
  const high = foot + FOOT;
  return `<svg xmlns="${at("overlay").namespaceURI}" width="${WIDE}" height="${high}" viewBox="0 0 ${WIDE} ${high}" font-family="sans-serif" font-size="12" fill="${colour("--ink")}"><rect width="${WIDE}" height="${high}" fill="${colour("--card")}"/><text x="${LEFT}" y="20">${escaped(title)}</text>${parts.join("")}</svg>\n`;
}
