// A second recording beside the first: its picture at the same time, its gap, and the difference of both.
import { at, inForce, listen, number, panel, say, submit, withToken } from "/page/bus.js";

panel("beside", 'Beside: <span id="second_source" class="quiet"></span>', `
  <img id="second_picture" alt="Picture of the second recording at the same time">
  <p id="second_words"></p>
  <p id="second_trouble" class="refused"></p>
  <form id="shift_form" class="row">
    <label>later by <input id="second_offset" type="text" inputmode="decimal" autocomplete="off" data-step="0.04" required> s</label>
    <button>Set</button>
  </form>
  <p id="second_settings" class="quiet"></p>`, { open: true, order: 5 });
at("beside").hidden = true;
const restore = inForce({ second_offset: ({ second }) => second && second.offset_s });
submit("shift_form", () => ({ do: "shift_second", offset_s: number("second_offset") }), restore);

let shown = "", loading = false;
// One picture at a time: the newest is asked for once the last has come.
function picture(second) {
  const wanted = `/second.jpg?frame=${second.frame}`;
  if (loading || second.frame === null || wanted === shown) return;
  shown = wanted;
  loading = true;
  at("second_picture").src = withToken(wanted);
}
for (const end of ["load", "error"]) at("second_picture").addEventListener(end, () => { loading = false; });
listen("state", ({ second, is_saved: saved }) => {
  at("beside").hidden = !second;
  if (!second || saved) return;
  say("second_source", second.source.split(/[/\\]+/).filter(Boolean).slice(-2).join("/"));
  at("second_source").title = second.source;
  picture(second);
  const gap = second.gap_mm === null ? `no gap: ${(second.status || "not measured yet").replaceAll("_", " ")}` : `${second.gap_mm.toFixed(4)} mm`;
  say("second_words", second.frame === null ? "" : `Frame ${second.frame}${second.time_s === null ? "" : `, ${second.time_s.toFixed(3)} s`}: ${gap}`);
  say("second_trouble", second.trouble);
  const same = second.own_settings ? `measured with settings of its own, ${second.px_per_mm === null ? "no scale" : `${second.px_per_mm.toFixed(3)} px/mm`}` : "measured with the same settings";
  say("second_settings", `Dashed in the chart, ${same}; ${second.measured < second.frames ? `${second.measured} of ${second.frames} frames so far` : `${second.frames} frames`}. Below the chart: this recording less the one beside.`);
});
