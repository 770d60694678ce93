// The value with its uncertainty, its status, and the facts of the source.
import { at, listen, page, say } from "/page/bus.js";

const LONGEST_SOURCE = 40; // letters: on a phone a longer name takes more than a line

function stale(words) {
  at("gap_mm").textContent = "–";
  at("uncertainty").textContent = "\u00a0";
  at("zeroed").hidden = true;
  say("status", words, "badge bad");
  at("why").textContent = "";
  at("verdict").hidden = true;
}
listen("gone", () => stale("not connected"));

listen("now", (now) => {
  const gap = at("gap_mm"), state = page.state;
  // What is old looks old: no value, and no green.
  if (state && (state.silent_s > 0 || state.ended)) { stale(state.ended ? (state.trouble ? "failed" : "ended") : "no picture"); return; }
  if (!now || now.gap_mm === null) {
    gap.textContent = "–";
    at("uncertainty").textContent = "\u00a0";
  } else {
    gap.textContent = (now.gap_mm - now.zero_mm).toFixed(4);
    const um = (u_mm) => `${(2000 * u_mm).toFixed(2)} µm`;
    const what = !now.has_budget ? " (k = 2, from frame to frame; the scale has no uncertainty)"
      : now.u_random_mm === null ? " (k = 2)" : `, of which from frame to frame ${um(now.u_random_mm)} (k = 2)`;
    at("zeroed").hidden = now.zero_mm === 0;
    at("zeroed").textContent = `less zero ${now.zero_mm.toFixed(4)} mm`;
    at("uncertainty").textContent = now.u_mm === null ? "" : `± ${um(now.u_mm)}${what}`;
  }
  gap.dataset.frame = now ? String(now.frame) : "";
  say("frame_number", now ? String(now.frame) : "–");
  say("status", now ? now.status : "–", `badge ${now && now.status === "ok" ? "good" : "bad"}`);
  // On a long way from a key frame, that is shown meanwhile, with its own value.
  const wanted = state && state.playback && !state.playback.playing ? state.playback.frame : null;
  say("why", !now ? "" : wanted === null || now.frame === wanted ? now.words : `Frame ${now.frame}, on the way to ${wanted}.`);
  at("unzero").hidden = !now || now.zero_mm === 0;
  if (now) say("unzero", `Zero off (${now.zero_mm.toFixed(4)} mm)`);
  const verdict = now ? now.verdict : "";
  at("verdict").hidden = !verdict;
  say("verdict", verdict, `badge ${{ pass: "good", fail: "bad", unsure: "unsure" }[verdict] || ""}`);
});

listen("state", (state) => {
  document.body.classList.toggle("fingerless", state.fingers === "none");
  document.body.classList.toggle("trouble", Boolean(state.trouble));
  // Of a long path its end tells most; the whole is what the pointer shows.
  const parts = state.source.split(/[/\\]+/).filter(Boolean);
  const is_long = state.source.length > LONGEST_SOURCE && parts.length > 2 && !state.source.includes("://");
  say("source", is_long ? `…/${parts.slice(-2).join("/")}` : state.source);
  at("source").title = state.source;
  say("rate", state.rate_hz === null ? "–" : state.rate_hz.toFixed(2));
  say("jitter", state.jitter_ms === null ? "–" : state.jitter_ms.toFixed(2));
  for (const id of ["dropped", "duplicates", "damaged"]) say(id, String(state[id]));
  say("frame_size", `${state.width_px}×${state.height_px}`);
  at("camera").hidden = !state.camera;
  say("camera", `Camera: ${state.camera}`);
  at("exposure").hidden = !state.exposure;
  say("exposure", state.exposure);
});
