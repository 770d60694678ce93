// Gauges over the picture: as they are set in the first frame, what was found in any, and points to drag them by.
import { ask, at, listen, page } from "/page/bus.js";
import { board, change, chosen, isFirst, request, show, tables, told, usual, works } from "/page/gauge_board.js";
import { dragged, drawn, handles, outline } from "/page/gauge_shapes.js";

const ASK_EVERY_MS = 100, LETTER = 12, POINT = 6, NAME_WEIGHT = 20, LEAST_PX = 3;
at("stage").insertAdjacentHTML("beforeend", '<svg id="gauge_drawing" aria-hidden="true" preserveAspectRatio="none"></svg>');
const svg = at("gauge_drawing"), SVG = svg.namespaceURI;
let drag = null, askedAt = 0;
export const drawing = { kind: null, name: "", said: () => {} };

const make = (name, attributes, words = "") => {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.textContent = words;
  return element;
};
// Whole coordinates are pixels' middles.
const path = (points) => points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("");
const line = (points, kind) => make("path", { d: path(points), class: kind });
const isOpen = () => told() && told().is_open && at("gauges").open;

function readingsHere() {
  const state = told();
  // The readings of another frame than the picture's would look right, and be wrong.
  return page.now && state && state.readings && page.now.frame === state.frame ? state.readings : null;
}
export function draw() {
  svg.replaceChildren();
  svg.classList.toggle("drawing", Boolean(drawing.kind));
  if (!isOpen()) return;
  const { width, height } = at("picture"), unit = width / (svg.clientWidth || width);
  svg.setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
  const readings = readingsHere(), first = isFirst(), now = chosen(), named = [];
  tables().forEach((table, i) => {
    const reading = readings && readings[i], is = table === now || (now && table.name === now.name) ? " chosen" : "";
    const good = reading ? (reading.status === "ok" ? " found" : " failed") : "";
    if (reading && reading.zone.length && !(drag && is)) svg.append(line(reading.zone, `zone${good}`));
    if (first) for (const each of outline(table)) svg.append(line(each, `set${is}`));
    if (reading && !(drag && is)) for (const mark of reading.marks) {
      if (mark.length > 1) svg.append(line(mark, `mark${good}`));
      else for (const [a, b] of [[1, 0], [0, 1]]) svg.append(line([[mark[0][0] - 5 * unit * a, mark[0][1] - 5 * unit * b], [mark[0][0] + 5 * unit * a, mark[0][1] + 5 * unit * b]], `mark${good}`));
    }
    const places = [...(first ? outline(table).flat() : []), ...(reading ? [...reading.zone, ...reading.marks.flat()] : [])];
    if (places.length) named.push([table, reading, boxOf(places), good + is]);
  });
  const boxes = named.map(([, , box]) => box), names = [];
  for (const each of named) names.push(name(...each, unit, [width, height], boxes, names));
  if (drag && drag.kind === "new") svg.append(line([drag.from, drag.to], "set chosen"));
  if (first && works() && !drawing.kind) for (const table of tables()) points(table, unit, now && table.name === now.name);
}
// Boxes are [left, top, right, bottom].
const boxOf = (places) => [[0, Math.min], [1, Math.min], [0, Math.max], [1, Math.max]].map(([k, least]) => least(...places.map((place) => place[k])));
const shared = (a, b) => Math.max(0, Math.min(a[2], b[2]) - Math.max(a[0], b[0])) * Math.max(0, Math.min(a[3], b[3]) - Math.max(a[1], b[1]));
// The name of a gauge stands beside it, where it covers least of the gauges and of the names before it.
function name(table, reading, box, kind, unit, [width, height], gauges, names) {
  const text = make("text", { "font-size": (LETTER * unit).toFixed(2), class: kind.trim() }, reading && reading.status !== "ok" ? `${table.name}: ${reading.status.replaceAll("_", " ")}` : table.name);
  svg.append(text);
  // Browsers round the width of small letters.
  const { width: letters, height: high, y: above } = text.getBBox(), apart = 3 * unit, wide = letters + apart, [left, top, right, bottom] = box;
  const rows = [top, bottom - high, top - high - apart, bottom + apart, top - 2 * high - apart, bottom + high + apart, top - 3 * high - apart, bottom + 2 * high + apart];
  const places = rows.flatMap((y) => [right + apart, left - apart - wide, ...(y < top - high || y > bottom ? [left] : [])].map((x) => [x, y]));
  let best = null, least = Infinity;
  for (const [x, y] of places) {
    const at_x = Math.max(0, Math.min(x, width - wide)), at_y = Math.max(0, Math.min(y, height - high)), own = [at_x, at_y, at_x + wide, at_y + high];
    const covered = gauges.reduce((sum, each) => sum + shared(own, each), 0) + names.reduce((sum, each) => sum + NAME_WEIGHT * shared(own, each), 0);
    if (covered < least) { least = covered; best = own; }
  }
  text.setAttribute("x", best[0].toFixed(1));
  text.setAttribute("y", (best[1] - above).toFixed(1));
  return best;
}
function points(table, unit, is) {
  for (const [handle, x, y] of handles(table)) {
    if (handle !== "middle" && !is) continue;
    const point = make("circle", { cx: x, cy: y, r: POINT * unit, class: `point${is ? " chosen" : ""}` });
    point.dataset.handle = handle;
    point.dataset.gauge = table.name;
    svg.append(point);
  }
}

function place(event) {
  const frame = svg.getBoundingClientRect(), { width, height } = at("picture");
  const x = ((event.clientX - frame.left) / frame.width) * width - 0.5, y = ((event.clientY - frame.top) / frame.height) * height - 0.5;
  return [Math.min(width - 1, Math.max(0, x)), Math.min(height - 1, Math.max(0, y))];
}
svg.addEventListener("pointerdown", (event) => {
  const { handle, gauge } = event.target.dataset;
  if (drawing.kind) drag = { kind: "new", from: place(event), to: place(event) };
  else if (handle) {
    board.chosen = gauge;
    drag = { kind: "old", handle, gauge, before: chosen() };
    listenChosen();
  } else return;
  svg.setPointerCapture(event.pointerId);
  event.preventDefault();
  draw();
});
svg.addEventListener("pointermove", (event) => {
  if (!drag) return;
  drag.to = place(event);
  if (drag.kind === "old") {
    drag.changes = dragged(drag.before, drag.handle, ...drag.to);
    show(drag.gauge, drag.changes);
    if (performance.now() - askedAt > ASK_EVERY_MS) { askedAt = performance.now(); change(drag.gauge, drag.changes, () => {}); }
  }
  draw();
});
svg.addEventListener("pointerup", () => {
  const done = drag;
  drag = null;
  if (!done) return;
  if (done.kind === "old") { if (done.changes) change(done.gauge, done.changes, (words) => { drawing.said(words); draw(); }); return; }
  const kind = drawing.kind, far = Math.hypot(done.to[0] - done.from[0], done.to[1] - done.from[1]);
  if (far < LEAST_PX) { drawing.said(`Drag over at least ${LEAST_PX} pixels of the picture.`); draw(); return; }
  add(drawn(usual(kind), done.from, done.to));
  stopDrawing();
});
svg.addEventListener("pointercancel", () => { drag = null; board.local = null; draw(); });

export function add(table) {
  request({ do: "gauge_add", table: drawing.name ? { ...table, name: drawing.name } : table }, (reply) => {
    drawing.said(reply.refused || "");
    if (reply.refused) return;
    board.chosen = drawing.name || table.name;
    drawing.added();
  });
}
export function beginDrawing(kind) {
  drawing.kind = kind;
  at("gauge_draw").setAttribute("aria-pressed", "true");
  if (!isFirst()) ask({ do: "seek", frame: told().first });
  at("hint").textContent = `Drag over the ${kind} in the ${told().is_live ? "picture" : "first frame"}; Escape lets it be.`;
  draw();
}
export function stopDrawing() {
  if (!drawing.kind) return;
  drawing.kind = null;
  at("gauge_draw").setAttribute("aria-pressed", "false");
  at("hint").textContent = "";
  draw();
}
let listenChosen = () => {};
export function onChosen(act) { listenChosen = act; }
listen("escape", () => { drag = null; board.local = null; stopDrawing(); });
listen("now", draw);
listen("zoomed", draw);

