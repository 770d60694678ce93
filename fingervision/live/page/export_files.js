// The table as CSV, and what is seen of the chart as SVG, PNG and CSV.
import { at, colour, download, listen, on, page, tell, withToken } from "/page/bus.js";
import { view } from "/page/chart.js";
import { svg } from "/page/export_svg.js";
import { gaps, terms } from "/page/gap_data.js";
import { marks } from "/page/time_ruler.js";

const MOST_PICTURES = 21, KEPT_MS = 60000, PNG_SCALE = 2;
const seenTimes = () => [view.chart.scales.x.min, view.chart.scales.x.max];
function save(content, kind, name, words) {
  const address = URL.createObjectURL(new Blob([content], { type: kind }));
  download(address, name);
  setTimeout(() => URL.revokeObjectURL(address), KEPT_MS);
  tell("message", `${words} as ${name}.`, "saved");
}
function title() {
  const { state } = page, zero = state && state.zero_mm ? `, less zero ${state.zero_mm.toFixed(4)} mm` : "";
  return `Gap of ${state ? state.source : ""}${state && state.second ? ` (dashed: ${state.second.source})` : ""}${zero}; band: k = 2; ${new Date().toISOString()}`;
}
const drawn = () => svg(title(), view.chart.data, at("residual_chart").hidden || !view.residual ? null : view.residual.data, seenTimes());
on("save_csv", "click", () => download(withToken("/gaps.csv"), "gaps.csv"));
// The page itself, with the pictures of what the ruler marks, the frame shown, and the ends.
on("save_page", "click", () => {
  const { frame, frames } = page.state.playback, found = marks(), every = Math.ceil(found.length / MOST_PICTURES);
  const wanted = new Set([0, frame, ...found.filter((_, i) => i % every === 0), frames - 1]);
  tell("message", `The page is saved with ${wanted.size} pictures, which are read from the recording now.`, "saved");
  download(withToken(`/saved.html?frames=${[...wanted].sort((a, b) => a - b).join(",")}`), "fingervision.html");
});
listen("state", ({ playback }) => { at("save_page").hidden = !playback; });
on("save_svg", "click", () => save(drawn(), "image/svg+xml", "gap.svg", "The plot was saved as it is shown,"));
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
  sheet.toBlob((blob) => save(blob, "image/png", "gap.png", "The plot was saved as it is shown,"));
});
on("save_seen", "click", () => {
  const [from, to] = seenTimes(), zero = page.state.zero_mm, cell = (value) => (value === null ? "" : value.toFixed(7));
  const lines = [`frame,time_s,status,gap_mm,expanded_u_gap_mm,${terms()[0]}_mm,${terms()[1]}_mm`];
  gaps.time.forEach((time, i) => {
    if (time < from || time > to || gaps.frame[i] === null) return;
    const gap = gaps.gap[i], model = gaps.model[i], known = gap !== null;
    lines.push([gaps.frame[i], time.toFixed(6), gaps.status[i] || "ok", cell(known ? gap - zero : null), cell(known ? gaps.high[i] - gap : null),
      cell(model === null ? null : model - zero), cell(known && model !== null ? gap - model : null)].join(","));
  });
  save(`${lines.join("\n")}\n`, "text/csv", "gap_seen.csv", `${lines.length - 1} rows that are seen were saved`);
});
