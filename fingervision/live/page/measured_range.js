// A range that is dragged over the chart is measured; it stays until another one, Escape, or its button.
import { ask, at, colour, listen, on, page, say, tell } from "/page/bus.js";
import { gaps, nameOf, pm, terms, zeroOf } from "/page/series_data.js";
import { redraw, zoomTo } from "/page/chart.js";
import { statistics } from "/page/range_statistics.js";

let range = null, measured = gaps;
function words() {
  const state = page.state, found = statistics(measured, ...range), zero = zeroOf(measured), { unit } = measured;
  if (!found) return `A range needs at least two frames with a value of ${nameOf(measured)}.`;
  const parts = [
    `${measured === gaps ? "" : `${nameOf(measured)}, `}${found.from.toFixed(3)} to ${found.to.toFixed(3)} s, frames ${found.first} to ${found.last}, n = ${found.n}`,
    `mean ${pm(found.mean - zero, found.U_mean)} ${unit}`, `slope ${pm(found.slope, found.U_slope)} ${unit}/s`,
    `first to last ${pm(found.change, found.U_change)} ${unit}`,
    `${(found.least - zero).toFixed(4)} to ${(found.greatest - zero).toFixed(4)} ${unit}`];
  if (found.residual) {
    const { n, mean, rms, U_mean } = found.residual, um = (mm) => (1e3 * mm).toFixed(1);
    parts.push(`${terms()[1]}${n < found.n ? ` of ${n} frames:` : ""} mean ${um(mean)}${U_mean === null ? "" : ` ± ${um(U_mean)}`}, RMS ${um(rms)} µm`);
  }
  return `${parts.join(" · ")} (± at k = 2${state.u_px_per_mm === null ? ", from frame to frame only: the scale has no uncertainty" : ""})`;
}
function show() {
  at("range_bar").hidden = !range;
  if (range) say("range_words", words());
  at("range_mark").hidden = !(page.state && page.state.playback);
  redraw();
}
function clear() { if (range) { range = null; show(); } }
listen("dragged", (from, to, series) => {
  range = [from, to];
  measured = series;
  show();
  at("announcer").textContent = at("range_words").textContent;
});
on("range_zoom", "click", () => zoomTo(...range));
on("range_mark", "click", () => {
  const found = statistics(measured, ...range);
  if (found) ask({ do: "range", first: found.first, last: found.last });
  else tell("message", "A range needs at least two frames with a value.", "refused");
});
on("range_clear", "click", clear);
listen("escape", clear);
listen("cleared", clear);
listen("gauges", clear);
listen("drawn", (chart) => {
  if (!range) return;
  const ink = chart.ctx, { top, height } = chart.bbox, [from, to] = range.map((time) => chart.valToPos(time, "x", true));
  ink.save();
  ink.beginPath(); ink.rect(chart.bbox.left, top, chart.bbox.width, height); ink.clip();
  ink.fillStyle = colour("--accent");
  ink.globalAlpha = 0.18;
  ink.fillRect(from, top, to - from, height);
  ink.restore();
});
