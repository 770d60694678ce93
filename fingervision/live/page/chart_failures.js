// Frames without a number, marked at the chart's foot: a hatched bar from the first to the last, with their reason.
import { colour } from "/page/bus.js";
import { gaps, shown } from "/page/series_data.js";

const BAR_PX = 12, HATCH_PX = 5;
// Runs of one reason within the time that is shown.
export function failures(min, max, { time, status, frame } = gaps) {
  const found = [];
  for (let i = 0; i < time.length; i += 1) {
    if (time[i] < min || time[i] > max || frame[i] === null || !status[i]) continue;
    const last = found[found.length - 1];
    if (last && last.end === i - 1 && last.status === status[i]) { last.end = i; last.to = time[i]; last.count += 1; }
    else found.push({ from: time[i], to: time[i], status: status[i], end: i, count: 1, first_frame: frame[i] });
    found[found.length - 1].last_frame = frame[i];
  }
  return found;
}
// Those of all series that are shown; the quantities of a gauge fail together.
export const allFailures = () => shown().filter(({ place }) => !place).flatMap((series) => failures(-Infinity, Infinity, series));
export function drawFailures(chart, series) {
  const { min, max } = chart.scales.x;
  if (min === null || max === null) return;
  const ink = chart.ctx, { left, top, width, height } = chart.bbox, ratio = devicePixelRatio;
  const high = BAR_PX * ratio, foot = top + height;
  let labelled = left;
  ink.save();
  ink.beginPath(); ink.rect(left, top, width, height); ink.clip();
  ink.strokeStyle = ink.fillStyle = colour("--bad");
  ink.lineWidth = ratio;
  ink.font = `${11 * ratio}px system-ui, sans-serif`;
  ink.textAlign = "left"; // the axes leave theirs
  ink.textBaseline = "alphabetic";
  for (const run of failures(min, max, series)) {
    const from = chart.valToPos(run.from, "x", true) - 2 * ratio, to = chart.valToPos(run.to, "x", true) + 2 * ratio;
    ink.strokeRect(from, foot - high, to - from, high - ratio);
    ink.save();
    ink.beginPath(); ink.rect(from, foot - high, to - from, high); ink.clip();
    ink.beginPath();
    for (let x = from - high; x < to; x += HATCH_PX * ratio) { ink.moveTo(x, foot); ink.lineTo(x + high, foot - high); }
    ink.stroke();
    ink.restore();
    const words = run.status.replaceAll("_", " "), wide = ink.measureText(words).width;
    const start = Math.min(from, left + width - wide - 2 * ratio);
    if (start >= labelled) { // one above the other would be read by nobody
      ink.fillText(words, start, foot - high - 3 * ratio);
      labelled = start + wide + 6 * ratio;
    }
  }
  ink.restore();
}
