// The set-up: traffic lights with their remedies, meters of focus and light, settings kept in a file.
import { ask, at, listen, on, panel, say, submit } from "/page/bus.js";
import { wantBox } from "/page/dragging.js";

// An edge of 1.2 px is that of a good lens in focus; from 5 px on nothing is measured (status blurred).
const GOOD_BLUR_PX = 1.6, WORST_BLUR_PX = 5, LIGHTS = { good: "✓ good", fair: "▲ fair", poor: "✗ poor" };
panel("set_up", 'Set-up <span id="set_up_head" class="quiet"></span>', `
  <div class="row">
    <label>focus <meter id="focus_meter" min="0" max="1" low="0.35" high="0.6" optimum="1"></meter></label><span id="focus_words" class="quiet"></span>
    <label>light <meter id="light_meter" min="0" max="1" low="0.25" high="0.98" optimum="0.7"></meter></label><span id="light_words" class="quiet"></span>
  </div>
  <div class="row">
    <button id="inspect">Look at the set-up</button>
    <button id="drag_height" aria-pressed="false">Drag height</button>
    <label>Fingers <select id="fingers"><option>auto</option><option>dark</option><option>light</option><option>none</option></select></label>
  </div>
  <p id="set_up_words" role="status"></p>
  <ul id="findings"></ul>
  <p id="budget_head" hidden>Uncertainty of this gap (k = 1):</p>
  <ul id="budget"></ul>
  <div class="row"><button id="save_settings">Save settings</button></div>
  <form id="load_form" class="row">
    <label>from <input id="settings_path" type="text" required autocomplete="off" placeholder="settings.toml"></label>
    <button>Load settings</button>
  </form>`, { open: false, order: 8 });
on("inspect", "click", () => ask({ do: "inspect" }));
on("save_settings", "click", () => ask({ do: "save_settings" }));
on("fingers", "change", () => ask({ do: "fingers", fingers: at("fingers").value }));
on("drag_height", "click", () => wantBox("drag_height", "Drag from the tips to the height that shall be measured.", (box, [x, y]) => ask({ do: "height_at", x, y })));
submit("load_form", () => ({ do: "load_settings", path: at("settings_path").value }));

function list(id, items) {
  const key = items.map((words) => words.join("|")).join("\n");
  if (at(id).dataset.shown === key) return;
  at(id).dataset.shown = key;
  at(id).replaceChildren(...items.map(([head, words, kind]) => {
    const item = document.createElement("li"), strong = document.createElement("strong");
    strong.textContent = head;
    if (kind) strong.className = kind;
    item.append(strong, ` ${words}`);
    return item;
  }));
}
listen("state", ({ set_up: now, meters, budget, fingers }) => {
  if (document.activeElement !== at("fingers")) at("fingers").value = fingers;
  const blur = meters.blur_px;
  at("focus_meter").value = blur === null ? 0 : Math.max(0, Math.min(1, (WORST_BLUR_PX - blur) / (WORST_BLUR_PX - GOOD_BLUR_PX)));
  say("focus_words", blur === null ? "no edge" : `edges ${blur.toFixed(2)} px`);
  at("light_meter").value = meters.light === null ? 0 : meters.light;
  say("light_words", meters.light === null ? "–" : `${(100 * meters.light).toFixed(0)} %${meters.contrast === null ? "" : `, contrast ${(100 * meters.contrast).toFixed(0)} %`}`);
  say("set_up_words", now.words);
  at("inspect").disabled = now.busy;
  const kinds = { good: "good", fair: "unsure", poor: "bad" };
  const mend = now.findings ? now.findings.filter((each) => each.severity !== "good").length : null;
  say("set_up_head", mend === null ? "" : mend ? `${mend} to look at` : "in order");
  list("findings", (now.findings || []).map((each) => [
    `${LIGHTS[each.severity]} ${each.name}${each.cost_um === null ? "" : ` (${each.cost_um.toFixed(2)} µm)`}:`,
    `${each.figure} ${each.remedy}`, kinds[each.severity]]));
  at("budget_head").hidden = !budget;
  list("budget", (budget || []).map(([source, um, supplied]) => [`${source}: ${um.toFixed(3)} µm`, supplied, ""]));
});
