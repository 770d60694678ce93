// Sentences: the log, the alarm where the eye is, and what a screen reader is told now and then.
import { at, listen, page, panel } from "/page/bus.js";

const LINES_KEPT = 100, REFUSED_FOR_MS = 6000, ANNOUNCED_EVERY_MS = 5000;
panel("messages", "Messages", '<div role="log" aria-label="Messages"><ol id="log"></ol></div>', { open: true, order: 90 });

listen("message", (words, name) => {
  const line = document.createElement("li");
  line.textContent = `${new Date().toLocaleTimeString()}  ${words}`;
  line.dataset.name = name || "";
  at("log").prepend(line);
  while (at("log").children.length > LINES_KEPT) at("log").lastChild.remove();
});

let refusedUntil = 0;
function alarm(words) {
  if (at("alarm").textContent !== words) at("alarm").textContent = words;
  at("alarm").hidden = !words;
}
listen("message", (words, name) => {
  if (name !== "refused") return;
  alarm(words);
  refusedUntil = performance.now() + REFUSED_FOR_MS;
});
listen("gone", alarm);
listen("state", (state) => {
  if (performance.now() < refusedUntil) return;
  if (state.trouble) alarm(state.trouble);
  else if (state.ended) alarm("The source has ended.");
  else if (state.silent_s > 0) alarm(`No picture for ${state.silent_s.toFixed(1)} s: the source is silent or cut off. Measuring resumes by itself.`);
  else if (state.px_per_mm === null) alarm("The scale is not known, so nothing is measured: drag over a reference and give its size, or type the scale.");
  else alarm("");
});

// Values change 25 times a second; whoever listens hears them when the status changes, and every few seconds.
let announcedAt = 0, announcedStatus = "";
listen("now", (now) => {
  const status = now ? now.status : "no picture", time = performance.now();
  if (status === announcedStatus && time - announcedAt < ANNOUNCED_EVERY_MS) return;
  announcedAt = time;
  announcedStatus = status;
  if (now && now.status === "not_asked") return;
  const gap = !now || now.gap_mm === null ? `No gap: ${status}.` : `Gap ${(now.gap_mm - now.zero_mm).toFixed(3)} millimetres.`;
  at("announcer").textContent = page.paused ? "" : gap;
});
