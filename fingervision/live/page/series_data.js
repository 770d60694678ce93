// What is measured over time, as the page has it: the gap, and each quantity of each gauge; columns of equal length, bounded
// for what goes on for ever.
import { listen, page, tell } from "/page/bus.js";

// Ten minutes at 25 frames a second; a live chart then forgets its beginning. A recording is kept whole.
const MOST_LIVE = 15000, HOLE_S = 0.15, HOLE_FRAMES = 4;
// `random` is the part of the standard uncertainty that differs from frame to frame, null where that is all of it.
export const COLUMNS = ["time", "value", "low", "high", "model", "frame", "status", "random", "u_difference"];
function emptied(series) { for (const name of COLUMNS) series[name] = []; return series; }
// The gap has a row for every frame of the source, also where none is asked for: its times are those of all series.
export const gaps = emptied({ gauge: "", quantity: "gap", unit: "mm" });
let gauges = [], begun = null, known = 0;
export const hasFingers = () => !page.state || page.state.fingers !== "none";
// All series that are shown.
export const shown = () => (hasFingers() ? [gaps, ...gauges] : gauges);
export const gaugeSeries = () => gauges;
export const nameOf = ({ gauge, quantity }) => (gauge ? `${gauge}: ${quantity}` : quantity);
export const zeroOf = (series) => (series === gaps && page.state ? page.state.zero_mm : 0);
listen("cleared", () => { emptied(gaps); tell("changed"); });

function add(series, ...cells) { COLUMNS.forEach((name, i) => series[name].push(cells[i])); }
function append(series, time, value, u, frame, status, random = null, model = null, u_difference = null) {
  const { rate_hz: rate } = page.state, hole_s = rate ? Math.max(HOLE_S, HOLE_FRAMES / rate) : 0.25;
  const last = series.time.length ? series.time[series.time.length - 1] : null;
  // Where frames are missing no line is drawn.
  if (last !== null && time - last > hole_s) add(series, (last + time) / 2, null, null, null, null, null, null, null, null);
  const half = value === null || u === null ? null : 2 * u;
  add(series, time, value, half === null ? value : value - half, half === null ? value : value + half, model, frame, status || "", random, u_difference);
}
function bound(series) {
  const too_many = series.time.length - MOST_LIVE;
  if (!page.state.whole && too_many > 0) for (const name of COLUMNS) series[name].splice(0, too_many);
}
listen("points", (points) => {
  if (!points.length) return;
  for (const [time, gap, u, frame, status, random, model, u_difference] of points) append(gaps, time, gap, u, frame, status, random, model, u_difference);
  bound(gaps);
  tell("changed");
});
// A gauge that was changed has another number; where the readings begin anew, so do all series.
listen("gauge_points", (told) => {
  if (!told && !gauges.length) return;
  if (!told || told.begun !== begun || told.first !== known) gauges = [];
  const before = new Map(gauges.map((each) => [`${each.number} ${each.quantity}`, each]));
  const now = (told ? told.gauges : []).flatMap(([number, gauge, quantities]) => quantities.map(([quantity, unit], place) => {
    const kept = before.get(`${number} ${quantity}`) || emptied({ number, quantity, unit, place });
    kept.gauge = gauge;
    return kept;
  }));
  const is_other = now.length !== gauges.length || now.some((each, i) => each !== gauges[i]);
  [begun, known] = told ? [told.begun, told.known] : [null, 0];
  gauges = now;
  for (const [time, frame, readings] of told ? told.rows : []) for (const [number, status, ...numbers] of readings) {
    for (const series of gauges) if (series.number === number) {
      const [value = null, u = null, random = null] = numbers.slice(3 * series.place);
      append(series, time, value, u, frame, status, random);
    }
  }
  gauges.forEach(bound);
  if (is_other) tell("gauges");
  if (is_other || (told && told.rows.length)) tell("changed");
});

// Place of the sample nearest to a time; -1 where there is none.
export function nearest(time, { time: times, frame } = gaps) {
  if (!times.length) return -1;
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < time) low = middle + 1; else high = middle;
  }
  if (low > 0 && Math.abs(times[low - 1] - time) <= Math.abs(times[low] - time)) low -= 1;
  while (low > 0 && frame[low] === null) low -= 1;
  return low;
}

// A value with its expanded uncertainty, to two digits of that.
const digits = (U) => Math.min(6, Math.max(1, 1 - Math.floor(Math.log10(U || 1e-4))));
export const pm = (value, U) => (U > 0 ? `${value.toFixed(digits(U))} ± ${U.toFixed(digits(U))}` : value.toFixed(4));
// What a series says in a frame: its value, or why there is none.
export function saidOf(series, i) {
  const value = series.value[i];
  if (value === null) return (series.status[i] || "–").replaceAll("_", " ");
  return pm(value - zeroOf(series), series.high[i] - value);
}

// What the gap is compared with, and what the difference is called: a model's residual, or the difference to a recording.
export const terms = () => (page.state && page.state.second ? ["beside", "difference", "diff."] : ["model", "residual", "resid."]);
// Half of the band about a difference: of the measured gap where a model is exact, else of both recordings.
export const halfOf = (columns, i) => (columns.u_difference[i] === null ? columns.high[i] - columns.value[i] : 2 * columns.u_difference[i]);
// Columns of the residual from a place on: time, measured less predicted (µm), and the ends of its band.
export function residuals(from) {
  const rows = [[], [], [], []];
  for (let i = from; i < gaps.time.length; i += 1) {
    const known_both = gaps.value[i] !== null && gaps.model[i] !== null, value = known_both ? 1000 * (gaps.value[i] - gaps.model[i]) : null;
    const half = known_both ? 1000 * halfOf(gaps, i) : 0;
    [gaps.time[i], value, known_both ? value - half : null, known_both ? value + half : null].forEach((cell, k) => rows[k].push(cell));
  }
  return rows;
}
