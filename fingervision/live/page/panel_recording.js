// A recording: a slider, buttons and keys to step, play, mark a range and measure it.
import { ask, at, listen, on, page, say, typed } from "/page/bus.js";
import { key } from "/page/keys.js";
import { gaps, nearest } from "/page/series_data.js";
import { redraw } from "/page/chart.js";
import { marks } from "/page/time_ruler.js";

const STEP_MANY = 25;
let scrubbing = false, asked = 0;
at("steps_bar").innerHTML = `
  <button id="play" aria-keyshortcuts="Space">Play</button>
  <button id="step_back" aria-label="One frame back" title="One frame back (←)">◀</button>
  <button id="step_on" aria-label="One frame on" title="One frame on (→)">▶</button>
  <label>frame <input id="go_frame" type="text" inputmode="decimal" autocomplete="off" aria-keyshortcuts="n"></label>
  <label><input id="go_time" type="text" inputmode="decimal" autocomplete="off" data-step="0.1" aria-label="Time in seconds" aria-keyshortcuts="t"> s</label>
  <select id="speed" aria-label="Speed"><option value="0.1">0.1×</option><option value="0.25">0.25×</option><option value="0.5">0.5×</option><option value="1" selected>1×</option><option value="2">2×</option><option value="4">4×</option><option value="8">8×</option><option value="10">10×</option></select>`;
at("transport").innerHTML = `
  <div id="recording_bar" hidden>
    <div id="ruler_box"><canvas id="ruler" aria-hidden="true"></canvas><input id="scrub" type="range" min="0" value="0" step="1" aria-label="Frame"></div>
    <div class="row">
      <span id="place" class="quiet"></span>
      <span id="range" class="quiet"></span>
      <span class="keys">
        <button id="mark_first" aria-keyshortcuts="[">From here</button>
        <button id="mark_last" aria-keyshortcuts="]">To here</button>
        <button id="unmark">Unmark</button>
        <button id="measure_range" aria-keyshortcuts="m">Measure</button>
      </span>
    </div>
  </div>`;
const playback = () => page.state && page.state.playback;
const bare = (act) => () => (playback() ? act(playback()) : false);

function step(by) { ask({ do: "step", by }); }
function mark(which) {
  const now = playback(), [first, last] = now.range || [0, now.frames - 1];
  const range = which === "first" ? { first: now.frame, last: Math.max(now.frame, last) } : { first: Math.min(first, now.frame), last: now.frame };
  ask({ do: "range", ...range });
}
on("play", "click", () => ask({ do: "play", on: !playback().playing, speed: Number(at("speed").value) }));
on("speed", "change", () => ask({ do: "play", on: playback().playing, speed: Number(at("speed").value) }));
on("step_back", "click", () => step(-1));
on("step_on", "click", () => step(1));
on("mark_first", "click", () => mark("first"));
on("mark_last", "click", () => mark("last"));
on("unmark", "click", () => ask({ do: "range", first: null, last: null }));
on("measure_range", "click", () => ask({ do: "measure", marked: Boolean(playback().range) }));
on("scrub", "input", () => {
  scrubbing = true;
  // The newest wish counts: as many as pictures come, and the last for sure.
  if (performance.now() - asked > 40) { asked = performance.now(); ask({ do: "seek", frame: Number(at("scrub").value) }); }
});
on("scrub", "change", () => { scrubbing = false; ask({ do: "seek", frame: Number(at("scrub").value) }); });
// A frame or a time that is typed; what is refused gives way to what is shown, and so does what was obeyed.
const typedIn = { go_frame: "frame", go_time: "time_s" };
let held = ""; // the field in which somebody is typing
for (const [id, name] of Object.entries(typedIn)) {
  on(id, "change", () => {
    if (at(id).value.trim()) ask({ do: "seek", [name]: typed(at(id).value) });
    held = "";
    fill(playback());
  });
  on(id, "focus", () => { held = id; at(id).select(); });
  on(id, "input", () => { held = id; });
  on(id, "blur", () => { held = ""; });
}
function fill(now) {
  const time = page.now && page.now.frame === now.frame && page.now.time_s !== null ? page.now.time_s : null;
  if (held !== "go_frame") at("go_frame").value = String(now.frame);
  if (held !== "go_time") at("go_time").value = time === null ? "" : time.toFixed(3);
}
function toMark(way) {
  const { frame } = playback(), all = way > 0 ? marks() : marks().reverse(), next = all.find((each) => way * (each - frame) > 0);
  if (next !== undefined) ask({ do: "seek", frame: next });
}
listen("picked", (time) => {
  const i = playback() ? nearest(time) : -1;
  if (i >= 0 && gaps.frame[i] !== null) ask({ do: "seek", frame: gaps.frame[i] });
});

key([" ", "p"], "play a recording, and stand", bare(() => at("play").click()));
key(["ArrowLeft", "ArrowRight"], "step through a recording, with Shift by 25 frames", (event) =>
  (playback() ? step((event.key === "ArrowLeft" ? -1 : 1) * (event.shiftKey ? STEP_MANY : 1)) : false));
key(["Home", "End"], "first and last frame of a recording", (event) =>
  (playback() ? ask({ do: "seek", frame: event.key === "Home" ? 0 : playback().frames - 1 }) : false));
key([",", "."], "previous and next mark of the ruler: turning point, failure, end of the range", (event) => (playback() ? toMark(event.key === "." ? 1 : -1) : false));
key(["n", "t"], "type the frame or the time to go to", (event) => (playback() ? at(event.key === "n" ? "go_frame" : "go_time").focus() : false));
key(["["], "mark a range from this frame on", bare(() => mark("first")));
key(["]"], "mark a range up to this frame", bare(() => mark("last")));
key(["m"], "measure the marked range, or all", bare(() => at("measure_range").click()));

let last = "";
listen("state", (state) => {
  const now = state.playback, live = !now;
  at("recording_bar").hidden = at("steps_bar").hidden = live;
  document.body.classList.toggle("recorded", !live);
  for (const id of ["pause", "record", "follow"]) at(id).hidden = !live;
  for (const id of ["frame_number", "rate", "jitter", "dropped"]) at(id).parentElement.hidden = !live;
  if (live) return;
  say("play", now.playing ? "Stand" : "Play");
  at("play").setAttribute("aria-pressed", String(now.playing));
  at("scrub").max = String(now.frames - 1);
  if (!scrubbing) at("scrub").value = String(now.frame);
  const progress = now.failure ? ` – ${now.failure}` : now.is_whole || state.px_per_mm === null ? "" : ` – measured ${now.measured}`;
  say("place", `frame ${now.frame} of ${now.frames}${progress}`);
  at("place").title = at("place").textContent;
  fill(now);
  say("range", now.range ? `marked ${now.range[0]} to ${now.range[1]}` : "");
  at("unmark").classList.toggle("away", !now.range);
  say("measure_range", now.measuring ? "Measuring…" : now.range ? "Measure range" : "Measure all");
  at("measure_range").disabled = now.measuring;
  const drawn = `${now.frame} ${now.range}`;
  if (drawn !== last) { last = drawn; redraw(); }
});

// The frame that is shown, and the marked range, on the chart.
listen("drawn", (chart) => {
  const now = playback();
  if (!now || !gaps.time.length) return;
  const ink = chart.ctx, { top, height } = chart.bbox, place = (frame) => {
    const i = gaps.frame.indexOf(frame);
    return i < 0 ? null : chart.valToPos(gaps.time[i], "x", true);
  };
  const style = getComputedStyle(document.documentElement), x = place(now.frame);
  ink.save();
  ink.strokeStyle = ink.fillStyle = style.getPropertyValue("--unsure").trim();
  ink.lineWidth = 2 * devicePixelRatio;
  ink.setLineDash([]);
  if (x !== null) { ink.beginPath(); ink.moveTo(x, top); ink.lineTo(x, top + height); ink.stroke(); }
  if (now.range) {
    const [from, to] = now.range.map(place);
    if (from !== null && to !== null) {
      ink.globalAlpha = 0.15;
      ink.fillRect(from, top, to - from, height);
      ink.globalAlpha = 1;
      ink.setLineDash([6, 4]);
      ink.strokeRect(from, top, to - from, height);
    }
  }
  ink.restore();
});
