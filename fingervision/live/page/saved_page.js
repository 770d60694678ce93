// In a page that was saved, in place of the socket: what the server would send stands in the page itself, with the pictures
// of some frames. Frames without a picture are not shown; their values are read in the chart.
import { at, listen, page, say, sendBy, tell } from "/page/bus.js";
import { draw } from "/page/picture_view.js";

const { state, points, gauge_points: gaugePoints, messages, frames, saved_at: savedAt } = JSON.parse(at("saved").textContent);
const bytes = (base64) => Uint8Array.from(atob(base64), (sign) => sign.charCodeAt(0));
const places = frames.map(({ now }) => now.frame);
let place = 0;

async function show(to) {
  place = Math.min(frames.length - 1, Math.max(0, to));
  const { now, overlay, picture, gauges } = frames[place];
  state.playback.frame = now.frame;
  state.gauges = gauges;
  page.now = now;
  tell("state", state);
  await draw(bytes(picture), overlay);
  tell("now", now);
}
function seek(frame) {
  let best = 0;
  places.forEach((each, i) => { if (Math.abs(each - frame) < Math.abs(places[best] - frame)) best = i; });
  if (places[best] !== frame) tell("message", `This page was saved without the picture of frame ${frame}: the nearest of its ${places.length} pictures is shown, frame ${places[best]}.`, "saved");
  show(best);
}
function frameAt(time) { return points.reduce((best, each) => (Math.abs(each[0] - time) < Math.abs(best[0] - time) ? each : best))[3]; }
const ACTS = {
  gauge_kinds: () => {}, // nothing is drawn in a saved page
  seek: ({ frame, time_s: time }) => { const wanted = frame === undefined ? frameAt(time) : frame; if (Number.isFinite(wanted)) seek(wanted); },
  step: ({ by }) => show(place + Math.sign(by)),
  range: ({ first, last }) => { state.playback.range = first === null ? null : [first, last]; tell("state", state); },
};
sendBy((request) => {
  if (ACTS[request.do]) ACTS[request.do](request);
  else tell("message", "This page was saved: it shows what was measured, and measures nothing.", "refused");
  return true;
});
listen("start", () => {
  page.state = state;
  document.body.classList.add("saved");
  say("connection", `saved ${savedAt}, ${places.length} pictures`);
  tell("cleared");
  tell("points", points);
  tell("gauge_points", gaugePoints);
  for (const [, name, words] of messages) tell("message", words, name);
  if (frames.length) show(0); else tell("state", state);
});
