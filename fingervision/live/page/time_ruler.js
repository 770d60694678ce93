// The ruler of a recording's time behind its slider: seconds, failures, turning points and the marked range.
import { at, colour, listen, page } from "/page/bus.js";
import { allFailures } from "/page/chart_failures.js";
import { gaps, nearest } from "/page/series_data.js";
import { decimals } from "/page/axis_labels.js";

export const THUMB_PX = 8; // as in live.css
const HIGH_PX = 34, MARK_PX = 6, APART_PX = 62, USUAL_RATE_HZ = 25, DRAWN_EVERY_MS = 150;
// A turn is a way back of at least this share of the gap's whole range, and of so many standard uncertainties.
const TURN_SHARE = 0.05, TURN_U = 6;
let turning = [], failing = [], dirty = true, last = "", drawnAt = 0;

// Places of the samples at which the gap turns.
export function turningPoints({ value: gap, high }) {
  const known = gap.flatMap((value, i) => (value === null ? [] : [i]));
  let least = Infinity, greatest = -Infinity, spread = 0;
  for (const i of known) { least = Math.min(least, gap[i]); greatest = Math.max(greatest, gap[i]); spread += (high[i] - gap[i]) / 2; }
  const back = Math.max(TURN_SHARE * (greatest - least), known.length ? (TURN_U * spread) / known.length : 0), found = [];
  let way = 0, top = known[0], foot = known[0];
  for (const i of known) {
    if (gap[i] > gap[top]) top = i;
    if (gap[i] < gap[foot]) foot = i;
    if (way >= 0 && gap[i] < gap[top] - back) { if (way) found.push(top); way = -1; foot = i; }
    else if (way <= 0 && gap[i] > gap[foot] + back) { if (way) found.push(foot); way = 1; top = i; }
  }
  return found;
}
const playback = () => page.state && page.state.playback;
const timeOf = (frame) => { const i = gaps.frame.indexOf(frame); return i < 0 ? frame / (page.state.rate_hz || USUAL_RATE_HZ) : gaps.time[i]; };
// Frame at a time, in between where there is none; beyond what is measured, by the rate.
function frameAt(time) {
  const end = gaps.time.length - 1, rate = page.state.rate_hz || USUAL_RATE_HZ;
  if (end < 0) return time * rate;
  if (time > gaps.time[end]) return gaps.frame[end] + (time - gaps.time[end]) * rate;
  const i = nearest(time);
  return gaps.frame[i] + (time - gaps.time[i]) * rate;
}
// Frames that the ruler marks, in order: for the keys that go from mark to mark.
export function marks() {
  const now = playback(), found = new Set(turning.map((i) => gaps.frame[i]));
  for (const run of failing) found.add(run.first_frame);
  for (const frame of (now && now.range) || []) found.add(frame);
  return [...found].sort((a, b) => a - b);
}
function draw() {
  const now = playback(), canvas = at("ruler"), wide = canvas.clientWidth;
  if (!now || !wide) return;
  const shown = `${wide} ${now.frames} ${now.range} ${devicePixelRatio} ${colour("--ink")}`;
  if ((!dirty && shown === last) || performance.now() - drawnAt < DRAWN_EVERY_MS) return;
  if (dirty) { turning = turningPoints(gaps); failing = allFailures(); }
  dirty = false; last = shown; drawnAt = performance.now();
  canvas.width = wide * devicePixelRatio;
  canvas.height = HIGH_PX * devicePixelRatio;
  const ink = canvas.getContext("2d"), place = (frame) => THUMB_PX / 2 + (frame / Math.max(1, now.frames - 1)) * (wide - THUMB_PX);
  ink.scale(devicePixelRatio, devicePixelRatio);
  ink.font = "11px system-ui, sans-serif";
  if (now.range) {
    ink.fillStyle = colour("--unsure");
    ink.globalAlpha = 0.25;
    ink.fillRect(place(now.range[0]), 0, place(now.range[1]) - place(now.range[0]), HIGH_PX);
    ink.globalAlpha = 1;
    for (const end of now.range) ink.fillRect(place(end) - 1, 0, 2, HIGH_PX);
  }
  seconds(ink, now, wide, place);
  ink.fillStyle = colour("--bad");
  for (const run of failing) {
    const from = place(run.first_frame), to = place(run.last_frame);
    ink.fillRect(from - 1, HIGH_PX - MARK_PX, Math.max(3, to - from + 2), MARK_PX);
  }
  ink.fillStyle = colour("--accent");
  for (const i of turning) {
    const x = place(gaps.frame[i]), up = gaps.value[i] > gaps.value[Math.max(0, i - 1)] || gaps.value[i] > gaps.value[Math.min(gaps.value.length - 1, i + 1)];
    ink.beginPath();
    ink.moveTo(x - 5, up ? HIGH_PX - 8 : HIGH_PX - 15); ink.lineTo(x + 5, up ? HIGH_PX - 8 : HIGH_PX - 15); ink.lineTo(x, up ? HIGH_PX - 15 : HIGH_PX - 8);
    ink.fill();
  }
  const words = `Frame. Ruler: ${turning.length} turning points, ${failing.length} stretches without a value${now.range ? ", a marked range" : ""}`;
  if (at("scrub").getAttribute("aria-label") !== words) at("scrub").setAttribute("aria-label", words);
}
function seconds(ink, now, wide, place) {
  const first = timeOf(0), end = first + (now.frames - 1) / (page.state.rate_hz || USUAL_RATE_HZ);
  const least = ((end - first) * APART_PX) / wide, power = 10 ** Math.floor(Math.log10(least || 1)), step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= least);
  ink.fillStyle = ink.strokeStyle = colour("--quiet");
  if (!(step > 0)) return;
  for (let time = Math.ceil(first / step) * step; time <= end + 1e-9; time += step) {
    const x = place(frameAt(time)), label = `${time.toFixed(decimals(step))} s`;
    if (x > wide) break;
    ink.fillRect(x, 0, 1, 5);
    ink.fillText(label, Math.max(0, Math.min(wide - ink.measureText(label).width, x - ink.measureText(label).width / 2)), 15);
  }
}
listen("changed", () => { dirty = true; });
listen("state", draw);
