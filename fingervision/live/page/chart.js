// The chart: gap with its band, the model's prediction where there is one, failures marked with their reason.
import { at, calm, colour, listen, on, page, tell } from "/page/bus.js";
import { gaps } from "/page/gap_data.js";
import { drawFailures } from "/page/chart_failures.js";
import { values, wide } from "/page/axis_labels.js";

const WINDOW_S = 30, DRAWN_EVERY_MS = 100, CALM_EVERY_MS = 1000, LEAST_WINDOW_S = 0.02, ZOOM = 1.6;
export const view = { chart: null, zoomed: false, dirty: false, range: null, cursor: -1 };

const cell = (digits) => (_, v) => (v === null || v === undefined ? "–" : v.toFixed(digits));
function size() { return { width: Math.max(200, at("chart").clientWidth), height: Math.max(90, at("chart").clientHeight) }; }
function make() {
  if (view.chart) view.chart.destroy();
  const ink = colour("--ink"), line = colour("--line"), accent = colour("--accent");
  const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 }, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelSize: 18 };
  view.chart = new uPlot({
    ...size(),
    legend: { show: false },
    cursor: { drag: { x: true, y: false, dist: 4 } },
    scales: { x: { time: false } },
    axes: [{ ...axis, label: "time (s)", size: 30, values }, { ...axis, label: "gap (mm)", size: wide, values }],
    series: [
      { label: "time (s)", value: cell(3) },
      { label: "gap (mm)", stroke: accent, width: 1.5, points: { show: false } },
      { label: "− U", stroke: "transparent", points: { show: false } },
      { label: "+ U", stroke: "transparent", points: { show: false } },
      { label: "model (mm)", stroke: colour("--model"), width: 1.5, dash: [7, 4], points: { show: false } },
    ],
    bands: [{ series: [3, 2], fill: accent + "44" }],
    hooks: {
      setSelect: [(chart) => { if (chart.select.width > 2) view.zoomed = true; }],
      draw: [(chart) => drawFailures(chart), (chart) => tell("drawn", chart)],
      setCursor: [(chart) => { if (chart.cursor.left >= 0) tell("pointed", chart.posToVal(chart.cursor.left, "x")); }],
    },
  }, [[], [], [], [], []], at("chart"));
  view.chart.over.addEventListener("dblclick", all);
  view.chart.over.addEventListener("click", (event) => {
    tell("picked", view.chart.posToVal(event.offsetX, "x"));
  });
  view.dirty = true;
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
  let from = 0;
  if (!view.zoomed && !whole) {
    from = gaps.time.findIndex((time) => time >= min);
    from = Math.max(0, from - 1);
  }
  const zero = page.state ? page.state.zero_mm : 0;
  const less = (column) => (zero === 0 ? column : column.map((v) => (v === null ? null : v - zero)));
  const shown = [gaps.time.slice(from), ...["gap", "low", "high", "model"].map((name) => less(gaps[name].slice(from)))];
  view.chart.batch(() => {
    view.chart.setData(shown, count < 2);
    if (count > 1) view.chart.setScale("x", { min, max });
  });
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
  new ResizeObserver(() => { if (view.chart) view.chart.setSize(size()); }).observe(at("chart"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", make);
  const again = () => { draw(); setTimeout(again, calm.matches ? CALM_EVERY_MS : DRAWN_EVERY_MS); };
  again();
});
