// The buttons beside the value.
import { ask, at, listen, on, page, say, tell, withToken } from "/page/bus.js";

on("pause", "click", () => {
  page.paused = !page.paused;
  at("pause").setAttribute("aria-pressed", String(page.paused));
  at("pause").textContent = page.paused ? "Go on" : "Pause";
  at("hint").textContent = page.paused ? "The view is paused; measuring goes on." : "";
  tell("paused");
});
on("record", "click", () => ask({ do: page.state && page.state.recording ? "stop" : "record" }));
on("snapshot", "click", () => ask({ do: "snapshot" }));
on("zero", "click", () => ask({ do: "zero" }));
on("unzero", "click", () => ask({ do: "zero", off: true }));
on("steps", "click", () => ask({ do: "steps" }));

listen("state", (state) => {
  const recording = state.recording !== null && state.recording !== undefined;
  at("record").setAttribute("aria-pressed", String(recording));
  say("record", recording ? "Stop" : "Record");
  at("recording").hidden = !recording;
  if (recording) {
    const room = state.recording.minutes_left === null ? "" : `; room for ${minutes(state.recording.minutes_left)}`;
    say("recording", `Recording: ${state.recording.frames} frames in ${state.recording.path}${room}`);
  }
});
const minutes = (left) => (left < 120 ? `${left.toFixed(left < 10 ? 1 : 0)} minutes` : `${(left / 60).toFixed(0)} hours`);

listen("reply", (reply) => {
  if (!reply.steps || !reply.steps.length) return;
  const place = at("step_pictures"), version = Date.now();
  place.replaceChildren(...reply.steps.map((name, number) => {
    const figure = document.createElement("figure"), picture = document.createElement("img"), words = document.createElement("figcaption");
    picture.src = withToken(`/steps/${number}.png?version=${version}`);
    picture.alt = words.textContent = name;
    figure.append(picture, words);
    return figure;
  }));
  place.hidden = false;
  place.scrollIntoView({ block: "nearest" });
});
