// The test bed: where it stands, moves within its limits, recipes; stop is always in view and on Escape.
import { ask, at, listen, number, on, page, panel, say, submit } from "/page/bus.js";
import { key } from "/page/keys.js";

panel("bed", 'Bed: <span id="bed_at" class="quiet"></span>', `
  <p id="bed_limits" class="quiet"></p>
  <p id="bed_doing" role="status"></p>
  <progress id="bed_progress" max="1" value="0" aria-label="Progress of the recipe" hidden></progress>
  <p id="bed_read_only" class="warning">Read only: whoever starts the live view can allow motions.</p>
  <form id="bed_move_form" class="row">
    <label>to <input id="bed_to" type="text" inputmode="decimal" autocomplete="off" required> mm</label>
    <label>at <input id="bed_speed" type="text" inputmode="decimal" autocomplete="off" value="0.5" required> mm/s</label>
    <button class="moves">Move</button>
    <button class="moves" id="bed_home" type="button">Home</button>
  </form>
  <form id="bed_jog_form" class="row">
    <label>jog for <input id="bed_for" type="text" inputmode="decimal" autocomplete="off" value="0.5" required> s</label>
    <button class="moves" id="bed_jog_down" type="button" aria-label="Jog towards closing">Jog −</button>
    <button class="moves" id="bed_jog_up" type="button" aria-label="Jog towards opening">Jog +</button>
  </form>
  <form id="bed_recipe_form" class="row">
    <label>recipe <input id="bed_recipe" type="text" required autocomplete="off" placeholder="recipe.toml"></label>
    <button class="moves">Run</button>
  </form>`, { open: true, order: 5 });
at("bed").hidden = true;
at("always").innerHTML = '<button id="bed_stop" class="stop" aria-keyshortcuts="Escape x" hidden>STOP motor</button>';

const stop = () => { if (page.state && page.state.bed) ask({ do: "bed_stop" }); };
on("bed_stop", "click", stop);
listen("escape", stop);
key(["x"], "stop the bed's motor; Escape does it too, also from a field", () => (page.state && page.state.bed ? stop() : false));
submit("bed_move_form", () => ({ do: "bed_move", to_mm: number("bed_to"), speed_mm_s: number("bed_speed") }));
submit("bed_jog_form", () => null);
submit("bed_recipe_form", () => ({ do: "bed_run", recipe: at("bed_recipe").value }));
on("bed_home", "click", () => ask({ do: "bed_home" }));
const signed = (sign, value) => (typeof value === "number" ? sign * value : sign < 0 ? `-${value}` : value);
const jog = (sign) => () => ask({ do: "bed_jog", speed_mm_s: signed(sign, number("bed_speed")), for_s: number("bed_for") });
on("bed_jog_down", "click", jog(-1));
on("bed_jog_up", "click", jog(1));

listen("state", ({ bed }) => {
  at("bed").hidden = at("bed_stop").hidden = !bed;
  if (!bed) return;
  const force = bed.force_n === null ? "" : `, ${bed.force_n.toFixed(3)} N`, { limits } = bed;
  say("bed_at", `${bed.position_mm.toFixed(3)} mm${force}`);
  say("bed_limits", `Limits: ${limits.lower_mm} to ${limits.upper_mm} mm, ${limits.speed_mm_s} mm/s, ${limits.force_n} N, gap at least ${limits.gap_mm} mm.`);
  say("bed_doing", bed.doing ? `The bed is ${bed.doing}.` : "The motor stands.");
  at("bed_progress").hidden = !bed.progress;
  if (bed.progress && bed.progress[1] > 0) at("bed_progress").value = Math.min(1, bed.progress[0] / bed.progress[1]);
  at("bed_read_only").hidden = bed.movable;
  for (const button of document.querySelectorAll(".moves")) button.disabled = !bed.movable || Boolean(bed.doing);
});
