// The chart read out: by the pointer, and by arrow keys from sample to sample.
import { at, listen, page } from "/page/bus.js";
import { gaps, halfOf, nearest, terms } from "/page/gap_data.js";
import { showTime, view } from "/page/chart.js";

export function words(i) {
  const zero = page.state ? page.state.zero_mm : 0, gap = gaps.gap[i], status = gaps.status[i];
  const parts = [`frame ${gaps.frame[i]}`, `${gaps.time[i].toFixed(3)} s`];
  if (gap === null) parts.push(`no gap: ${(status || "–").replaceAll("_", " ")}`);
  else {
    const half = gaps.high[i] - gap;
    parts.push(`${(gap - zero).toFixed(4)}${half > 0 ? ` ± ${half.toFixed(4)}` : ""} mm`);
    if (gaps.model[i] !== null) parts.push(`${terms()[0]} ${(gaps.model[i] - zero).toFixed(4)} mm, ${terms()[1]} ${(1000 * (gap - gaps.model[i])).toFixed(1)} ± ${(1000 * halfOf(gaps, i)).toFixed(1)} µm`);
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
