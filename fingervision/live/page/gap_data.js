// The gap over time as the page has it: columns of equal length, bounded for what goes on for ever.
import { listen, page, tell } from "/page/bus.js";

// Ten minutes at 25 frames a second; a live chart then forgets its beginning. A recording is kept whole.
const MOST_LIVE = 15000, HOLE_S = 0.15, HOLE_FRAMES = 4;
// `random` is the part of the standard uncertainty that differs from frame to frame, null where that is all of it.
export const COLUMNS = ["time", "gap", "low", "high", "model", "frame", "status", "random", "u_difference"];
export const gaps = {};
function clear() { for (const name of COLUMNS) gaps[name] = []; }
clear();
listen("cleared", () => { clear(); tell("changed"); });

listen("points", (points) => {
  if (!points.length) return;
  const state = page.state, hole_s = state.rate_hz ? Math.max(HOLE_S, HOLE_FRAMES / state.rate_hz) : 0.25;
  for (const [time, gap, u, frame, status, random, model, u_difference] of points) {
    const last = gaps.time.length ? gaps.time[gaps.time.length - 1] : null;
    // Where frames are missing no line is drawn.
    if (last !== null && time - last > hole_s) add((last + time) / 2, null, null, null, null, null, null, null, null);
    const half = gap === null || u === null ? null : 2 * u;
    add(time, gap, half === null ? gap : gap - half, half === null ? gap : gap + half, model === undefined ? null : model, frame, status || "", random, u_difference === undefined ? null : u_difference);
  }
  const too_many = gaps.time.length - MOST_LIVE;
  if (!state.whole && too_many > 0) for (const name of COLUMNS) gaps[name].splice(0, too_many);
  tell("changed");
});
function add(...cells) { COLUMNS.forEach((name, i) => gaps[name].push(cells[i])); }

// Place of the sample nearest to a time; -1 where there is none.
export function nearest(time) {
  const times = gaps.time;
  if (!times.length) return -1;
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < time) low = middle + 1; else high = middle;
  }
  if (low > 0 && Math.abs(times[low - 1] - time) <= Math.abs(times[low] - time)) low -= 1;
  while (low > 0 && gaps.frame[low] === null) low -= 1;
  return low;
}

// What the gap is compared with, and what the difference is called: a model's residual, or the difference to a recording.
export const terms = () => (page.state && page.state.second ? ["beside", "difference", "diff."] : ["model", "residual", "resid."]);
// Half of the band about a difference: of the measured gap where a model is exact, else of both recordings.
export const halfOf = (columns, i) => (columns.u_difference[i] === null ? columns.high[i] - columns.gap[i] : 2 * columns.u_difference[i]);
// Columns of the residual from a place on: time, measured less predicted (µm), and the ends of its band.
export function residuals(from) {
  const rows = [[], [], [], []];
  for (let i = from; i < gaps.time.length; i += 1) {
    const known = gaps.gap[i] !== null && gaps.model[i] !== null, value = known ? 1000 * (gaps.gap[i] - gaps.model[i]) : null;
    const half = known ? 1000 * halfOf(gaps, i) : 0;
    [gaps.time[i], value, known ? value - half : null, known ? value + half : null].forEach((cell, k) => rows[k].push(cell));
  }
  return rows;
}
