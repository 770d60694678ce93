// Who works the live view: a page that only looks has no controls, and one whose pen another holds may take it over.
import { ask, at, listen, on } from "/page/bus.js";

// What only moves through the frames is left to a page that was saved.
const MOVES = new Set(["step_back", "step_on", "scrub", "go_frame", "go_time", "mark_first", "mark_last", "unmark"]);
const WORKS = ["record", "zero", "unzero", "snapshot", "drag_region", "whole", "tips", "below_tip", "play", "step_back", "step_on", "scrub", "go_frame", "go_time", "speed", "mark_first", "mark_last", "unmark", "measure_range", "next_run", "inspect", "drag_height", "fingers", "save_settings", "drag_reference"];
at("always").insertAdjacentHTML("beforebegin", '<span id="looks_on" class="badge unsure" hidden>looking on</span><button id="take_over" hidden>Take over</button>');
on("take_over", "click", () => ask({ do: "take_over" }));
let shown = null;
listen("state", ({ viewer, holds_pen: holds, is_saved: saved }) => {
  const works = !viewer && holds !== false;
  if (works === shown) return;
  shown = works;
  at("looks_on").hidden = works || saved;
  at("take_over").hidden = works || viewer;
  for (const id of WORKS) if (at(id) && !(saved && MOVES.has(id))) at(id).disabled = !works;
  for (const each of document.querySelectorAll("#panels form input, #panels form select, #panels form button:not(.moves)")) each.disabled = !works;
});
