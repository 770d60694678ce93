// The chart read out: by the pointer, and by arrow keys from sample to sample.
import { at, listen } from "/page/bus.js";
import { gaps, halfOf, nameOf, nearest, saidOf, shown, terms, zeroOf } from "/page/series_data.js";
import { showTime, view } from "/page/chart.js";

// The sample of the gap at a place, or that of the gauge whose chart is pointed at in the same frame.
export function words(i) {
  const [first] = shown(), series = shown().includes(view.pointed) ? view.pointed : first || gaps;
  const k = series === gaps ? i : nearest(gaps.time[i], series), parts = [`frame ${gaps.frame[i]}`, `${gaps.time[i].toFixed(3)} s`];
  if (k < 0 || series.frame[k] !== gaps.frame[i]) return parts.join(" · ");
  if (series !== gaps) parts.push(nameOf(series));
  const value = series.value[k], model = series.model[k];
  if (series !== gaps) parts.push(`${saidOf(series, k)}${value === null ? "" : ` ${series.unit}`}`);
  else if (value === null) parts.push(`no gap: ${saidOf(gaps, k)}`);
  else {
    const zero = zeroOf(gaps), half = gaps.high[k] - value;
    parts.push(`${(value - zero).toFixed(4)}${half > 0 ? ` ± ${half.toFixed(4)}` : ""} mm`);
    if (model !== null) parts.push(`${terms()[0]} ${(model - zero).toFixed(4)} mm, ${terms()[1]} ${(1000 * (value - model)).toFixed(1)} ± ${(1000 * halfOf(gaps, k)).toFixed(1)} µm`);
  }
  return parts.join(" · ");
}
function point(i, aloud) {
  if (i < 0 || gaps.frame[i] === null) return;
  view.cursor = i;
  at("readout").textContent = words(i);
  at("readout").dataset.time = gaps.time[i];
  if (aloud) at("announcer").textContent = words(i);
}
listen("pointed", (time) => point(nearest(time), false));
listen("cleared", () => { view.cursor = -1; });

// In a live view arrows move along the chart; a recording's own script steps through its frames.
export function move(samples) {
  if (!gaps.time.length) return;
  const shown = view.cursor < 0 || view.cursor >= gaps.time.length ? gaps.time.length - 1 : view.cursor;
  let i = Math.min(gaps.time.length - 1, Math.max(0, shown + samples));
  while (i > 0 && i < gaps.time.length - 1 && gaps.frame[i] === null) i += Math.sign(samples);
  goTo(i);
}
export function goTo(i) {
  view.zoomed = true;
  showTime(gaps.time[i]);
  view.chart.setCursor({ left: view.chart.valToPos(gaps.time[i], "x"), top: 10 }, false);
  point(i, true);
}
