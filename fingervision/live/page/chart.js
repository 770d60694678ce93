// The chart: gap with its band, the model's prediction where there is one, failures marked with their reason.
import { at, calm, colour, listen, on, page, tell } from "/page/bus.js";
import { gaps, zeroOf } from "/page/series_data.js";
import { drawFailures } from "/page/chart_failures.js";
import { decimals, values, wide } from "/page/axis_labels.js";

const WINDOW_S = 30, DRAWN_EVERY_MS = 100, CALM_EVERY_MS = 1000, REST = 4, LEAST_WINDOW_S = 0.02, ZOOM = 1.6, WHEEL = 0.0015;
export const view = { chart: null, residual: null, zoomed: false, dirty: false, cursor: -1, pointed: gaps };
const charts = new Map(); // with the place of each

const sizeOf = (place) => ({ width: Math.max(200, place.clientWidth), height: Math.max(70, place.clientHeight) });
export function axisOf(label) {
  const line = { stroke: colour("--line"), width: 1 }, upright = !label.startsWith("time");
  return { stroke: colour("--ink"), grid: line, ticks: line, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelSize: 18, label, size: upright ? wide : 30, values };
}
// A line of the chart, or the unseen end of a band.
export const seriesOf = (label, name = null, dash = undefined) => ({ label, stroke: name ? colour(name) : "transparent", width: 1.5, dash, points: { show: false } });
export const bandOf = (name, series = [3, 2]) => ({ series, fill: `${colour(name)}44` });
// What drags, clicks and the wheel do on each chart. A drag measures a range, and with Shift zooms into it. Where the wheel
// scrolls from chart to chart, it zooms with Ctrl.
function steer(chart, series, scrolls) {
  let zooms = false;
  chart.over.addEventListener("mousedown", (event) => { zooms = event.shiftKey; }, true);
  chart.over.addEventListener("mouseenter", () => { view.pointed = series; });
  chart.over.addEventListener("dblclick", all);
  chart.over.addEventListener("click", (event) => tell("picked", chart.posToVal(event.offsetX, "x")));
  chart.over.addEventListener("wheel", (event) => {
    if (scrolls && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(event.deltaY * WHEEL * (event.deltaMode === 1 ? 16 : 1)), chart.posToVal(event.offsetX, "x"));
  }, { passive: false });
  chart.hooks.setSelect = [() => {
    const { left, width } = chart.select;
    if (width <= 2) return;
    const [from, to] = [left, left + width].map((x) => chart.posToVal(x, "x"));
    chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    if (zooms) zoomTo(from, to); else tell("dragged", from, to, series);
  }];
}
const cursor = { drag: { x: true, y: false, dist: 4, setScale: false }, sync: { key: "gap", setSeries: false, filters: { pub: (kind) => kind === "mousemove" || kind === "mouseleave", sub: () => true } } };
// A chart of a series in its place, which is filled and steered as all the others.
export function plot(place, series, { axes, lines, bands, draw: drawn = () => {}, scrolls = false, ...hooks }) {
  const chart = new uPlot({
    ...sizeOf(place),
    legend: { show: false },
    cursor,
    scales: { x: { time: false } },
    axes,
    series: lines,
    bands,
    hooks: { draw: [drawn, (made) => tell("drawn", made)], ...hooks },
  }, lines.map(() => []), place);
  steer(chart, series, scrolls);
  const seen = new ResizeObserver(() => { chart.setSize(sizeOf(place)); redraw(); });
  seen.observe(place);
  charts.set(chart, seen);
  return chart;
}
export function remove(chart) {
  if (!chart) return;
  charts.get(chart).disconnect();
  charts.delete(chart);
  chart.destroy();
}
// Time without a label, which would take a third of a small chart: the unit stands behind each number.
export const briefTimes = () => ({ ...axisOf("time (s)"), label: null, values: (chart, places, axis, room, step) => places.map((time) => `${time.toFixed(decimals(step))} s`) });
const BARE_PX = 6; // with the residual below, its time axis is that of both
export function make() {
  const before = view.chart && view.chart.scales.x, bare = document.body.classList.contains("modelled");
  remove(view.chart);
  view.chart = plot(at("chart"), gaps, {
    axes: [bare ? { ...axisOf("time (s)"), label: null, size: BARE_PX, values: (chart, places) => places.map(() => "") } : axisOf("time (s)"), axisOf("gap (mm)")],
    lines: [seriesOf("time (s)"), seriesOf("gap (mm)", "--accent"), seriesOf("− U"), seriesOf("+ U"), seriesOf("model (mm)", "--model", [7, 4])],
    bands: [bandOf("--accent")],
    draw: (chart) => drawFailures(chart, gaps),
    setScale: [(chart, key) => { if (key === "x") tell("scaled", chart.scales.x.min, chart.scales.x.max); }],
    setCursor: [(chart) => { if (chart.cursor.left >= 0) tell("pointed", chart.posToVal(chart.cursor.left, "x")); }],
  });
  if (view.zoomed && before) view.chart.setScale("x", { min: before.min, max: before.max });
  view.dirty = true;
}
// Place of the sample before a time; all are drawn where there is none.
export const placeBefore = (series, from) => (from === null ? 0 : Math.max(0, series.time.findIndex((time) => time >= from) - 1));
// The columns that a chart draws, from a time on.
export function columnsOf(series, from, names = ["value", "low", "high"]) {
  const first = placeBefore(series, from), zero = zeroOf(series);
  const less = (column) => (zero === 0 ? column : column.map((v) => (v === null ? null : v - zero)));
  return [series.time.slice(first), ...names.map((name) => less(series[name].slice(first)))];
}
export function redraw() { for (const chart of charts.keys()) chart.redraw(false, true); } // with its axes: without, a layout that is due would be forgotten
export function zoomTo(from, to) {
  view.zoomed = true;
  view.dirty = true;
  view.chart.setScale("x", { min: from, max: to });
}

function follow() { view.zoomed = false; view.dirty = true; }
export function all() { // from the beginning on, as far as it is kept
  const times = gaps.time;
  view.zoomed = true;
  view.dirty = true;
  if (times.length > 1) view.chart.setScale("x", { min: times[0], max: times[times.length - 1] });
}
export function zoom(factor, about = null) {
  const { min, max } = view.chart.scales.x;
  if (min === null || max === null) return;
  const middle = about === null ? (min + max) / 2 : about, wide = Math.max(LEAST_WINDOW_S, (max - min) * factor);
  view.zoomed = true;
  view.dirty = true;
  const share = max > min ? (middle - min) / (max - min) : 0.5;
  view.chart.setScale("x", { min: middle - share * wide, max: middle + (1 - share) * wide });
}
export function showTime(time) { // scroll a zoomed chart so that a time is in it
  const { min, max } = view.chart.scales.x;
  if (min === null || (time >= min && time <= max)) return;
  view.chart.setScale("x", { min: time - (max - min) / 2, max: time + (max - min) / 2 });
}

function draw() {
  if (!view.dirty || !view.chart || page.paused || document.hidden) return;
  view.dirty = false;
  const count = gaps.time.length, whole = page.state && page.state.whole;
  let { min, max } = view.chart.scales.x;
  // New points come in without moving what is looked at; else the last half minute moves along.
  if (!view.zoomed && count > 1) {
    max = gaps.time[count - 1];
    min = whole ? gaps.time[0] : Math.max(gaps.time[0], max - WINDOW_S);
  }
  const from = !view.zoomed && !whole ? min : null, columns = columnsOf(gaps, from, ["value", "low", "high", "model"]);
  view.chart.batch(() => {
    view.chart.setData(columns, count < 2);
    if (count > 1) view.chart.setScale("x", { min, max });
  });
  tell("charted", from, count > 1 ? { min, max } : null);
}
listen("changed", () => { view.dirty = true; });
listen("paused", () => { view.dirty = true; });
listen("state", (state) => {
  if (state.zero_mm !== view.zero) { view.zero = state.zero_mm; view.dirty = true; }
});
on("follow", "click", follow);
on("zoom_in", "click", () => zoom(1 / ZOOM));
on("zoom_out", "click", () => zoom(ZOOM));
listen("start", () => {
  make();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { make(); tell("recoloured"); });
  // Of many long series, drawing leaves most of the time to everything else.
  const again = () => { const began = performance.now(); draw(); setTimeout(again, Math.max(calm.matches ? CALM_EVERY_MS : DRAWN_EVERY_MS, REST * (performance.now() - began))); };
  again();
});
