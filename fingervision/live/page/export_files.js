// The table as CSV, and what is seen of the chart as SVG, PNG and CSV.
import { at, colour, download, listen, on, page, tell, withToken } from "/page/bus.js";
import { columnsOf, view } from "/page/chart.js";
import { failures } from "/page/chart_failures.js";
import { svg } from "/page/export_svg.js";
import { gaps, gaugeSeries, hasFingers, nameOf, terms } from "/page/series_data.js";
import { marks } from "/page/time_ruler.js";

const MOST_PICTURES = 21, KEPT_MS = 60000, PNG_SCALE = 2, HIGH = 300;
const what = () => (hasFingers() ? "gap" : "gauges");
const seenTimes = () => [view.chart.scales.x.min, view.chart.scales.x.max];
function save(content, kind, name, words) {
  const address = URL.createObjectURL(new Blob([content], { type: kind }));
  download(address, name);
  setTimeout(() => URL.revokeObjectURL(address), KEPT_MS);
  tell("message", `${words} as ${name}.`, "saved");
}
function title() {
  const { state } = page, zero = state && state.zero_mm ? `, less zero ${state.zero_mm.toFixed(4)} mm` : "";
  return `${hasFingers() ? "Gap" : "Gauges"} of ${state ? state.source : ""}${state && state.second ? ` (dashed: ${state.second.source})` : ""}${zero}; band: k = 2; ${new Date().toISOString()}`;
}
function drawn() {
  const [from, to] = seenTimes(), gap = { name: "gap", columns: view.chart.data, high: HIGH, stroke: "--accent", label: "gap (mm)", failing: failures(from, to) };
  const residual = { name: "residual", columns: view.residual && view.residual.data, high: HIGH / 2, stroke: "--model", label: `${terms()[1]} (µm)`, failing: [] };
  const gauges = gaugeSeries().map((series, i) => ({
    name: `gauge_${i}`, columns: columnsOf(series, null), high: HIGH / 2, stroke: "--accent", label: `${nameOf(series)} (${series.unit})`, failing: failures(from, to, series) }));
  return svg(title(), [...(hasFingers() ? [gap] : []), ...(at("residual_chart").hidden || !view.residual ? [] : [residual]), ...gauges], [from, to]);
}
// Of gauges, a part is not saved as if it were all.
function isPart() {
  const { gauges } = page.state, is = gaugeSeries().length > 0 && gauges && !gauges.is_whole;
  if (is) tell("message", gauges.trouble || `The gauges are measured in ${gauges.frames} frames until now: save when all are measured.`, "refused");
  return is;
}
on("save_csv", "click", () => {
  if (isPart()) return;
  if (hasFingers()) download(withToken("/gaps.csv"), "gaps.csv");
  if (gaugeSeries().length) download(withToken("/gauges.csv"), "gauges.csv");
  else if (!hasFingers()) tell("message", "There is nothing to save yet: draw a gauge.", "refused");
});
// The page itself, with the pictures of what the ruler marks, the frame shown, and the ends.
on("save_page", "click", () => {
  if (isPart()) return;
  const { frame, frames } = page.state.playback, found = marks(), every = Math.ceil(found.length / MOST_PICTURES);
  const wanted = new Set([0, frame, ...found.filter((_, i) => i % every === 0), frames - 1]);
  tell("message", `The page is saved with ${wanted.size} pictures, which are read from the recording now.`, "saved");
  download(withToken(`/saved.html?frames=${[...wanted].sort((a, b) => a - b).join(",")}`), "fingervision.html");
});
listen("state", ({ playback }) => { at("save_page").hidden = !playback; });
on("save_svg", "click", () => save(drawn(), "image/svg+xml", `${what()}.svg`, "The plot was saved as it is shown,"));
on("save_plot", "click", async () => {
  const picture = new Image(), address = URL.createObjectURL(new Blob([drawn()], { type: "image/svg+xml" })), sheet = document.createElement("canvas");
  picture.src = address;
  await picture.decode();
  sheet.width = PNG_SCALE * picture.width;
  sheet.height = PNG_SCALE * picture.height;
  const ink = sheet.getContext("2d");
  ink.fillStyle = colour("--card");
  ink.fillRect(0, 0, sheet.width, sheet.height);
  ink.drawImage(picture, 0, 0, sheet.width, sheet.height);
  URL.revokeObjectURL(address);
  sheet.toBlob((blob) => save(blob, "image/png", `${what()}.png`, "The plot was saved as it is shown,"));
});
on("save_seen", "click", () => {
  const [from, to] = seenTimes(), zero = page.state.zero_mm, cell = (value) => (value === null ? "" : value.toFixed(7)), seen = (time) => time >= from && time <= to;
  const lines = [`frame,time_s,status,gap_mm,expanded_u_gap_mm,${terms()[0]}_mm,${terms()[1]}_mm`], readings = ["frame,time_s,gauge,quantity,value,expanded_u,unit,status"];
  gaps.time.forEach((time, i) => {
    if (!seen(time) || gaps.frame[i] === null) return;
    const gap = gaps.value[i], model = gaps.model[i], known = gap !== null;
    lines.push([gaps.frame[i], time.toFixed(6), gaps.status[i] || "ok", cell(known ? gap - zero : null), cell(known ? gaps.high[i] - gap : null),
      cell(model === null ? null : model - zero), cell(known && model !== null ? gap - model : null)].join(","));
  });
  for (const { gauge, quantity, unit, time, frame, value, high, status } of gaugeSeries()) time.forEach((at_s, i) => {
    if (!seen(at_s) || frame[i] === null) return;
    readings.push([frame[i], at_s.toFixed(6), `"${gauge.replaceAll('"', '""')}"`, quantity, cell(value[i]), cell(value[i] === null ? null : high[i] - value[i]), unit, status[i] || "ok"].join(","));
  });
  if (hasFingers()) save(`${lines.join("\n")}\n`, "text/csv", "gap_seen.csv", `${lines.length - 1} rows that are seen were saved`);
  if (readings.length > 1) save(`${readings.join("\n")}\n`, "text/csv", "gauges_seen.csv", `${readings.length - 1} readings that are seen were saved`);
});
