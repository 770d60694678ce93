// Region, tips, height, tolerance and scale.
import { ask, at, beside, inForce, listen, number, on, page, panel, say, submit } from "/page/bus.js";
import { shown, wantBox } from "/page/dragging.js";

panel("measuring", "Region and tips", `
  <div class="row">
    <button id="drag_region" aria-pressed="false">Drag region</button>
    <button id="whole">Whole picture</button>
    <label>Tips <select id="tips"><option>auto</option><option>up</option><option>down</option><option>left</option><option>right</option></select></label>
    <label>Below tip <input id="below_tip" type="text" inputmode="decimal" autocomplete="off" data-step="0.05" size="5"> mm</label>
  </div>
  <form id="region_form" class="row">
    <label>x <input id="region_x" type="text" inputmode="decimal" autocomplete="off" required></label>
    <label>y <input id="region_y" type="text" inputmode="decimal" autocomplete="off" required></label>
    <label>w <input id="region_w" type="text" inputmode="decimal" autocomplete="off" required></label>
    <label>h <input id="region_h" type="text" inputmode="decimal" autocomplete="off" required></label>
    <button>Set region</button>
  </form>`, { open: true, order: 10 });
panel("tolerance", "Tolerance", `
  <form id="limits_form" class="row">
    <label>from <input id="least" type="text" inputmode="decimal" autocomplete="off"></label>
    <label>to <input id="greatest" type="text" inputmode="decimal" autocomplete="off"> mm</label>
    <button>Set</button>
  </form>`, { open: true, order: 20 });
panel("scaling", 'Scale: <span id="scale" class="quiet">not known</span>', `
  <form id="scale_form" class="row">
    <label><input id="px_per_mm" type="text" inputmode="decimal" autocomplete="off" required> px/mm</label>
    <label>u <input id="u_px_per_mm" type="text" inputmode="decimal" autocomplete="off" placeholder="unknown"></label>
    <button>Set</button>
  </form>
  <form id="calibrate_form" class="row">
    <select id="kind" aria-label="Kind of reference"><option>bar</option><option>slot</option></select>
    <label>size <input id="size_mm" type="text" inputmode="decimal" autocomplete="off" required> mm</label>
    <label>u (k = 1) <input id="u_size_mm" type="text" inputmode="decimal" autocomplete="off" value="0.001" required> mm</label>
    <button id="drag_reference" type="button" aria-pressed="false">Drag over it</button>
    <button>Calibrate</button>
    <button id="more_references" value="more" title="Keep this reference, and mark another one, also in another frame: three sizes, or a bar and a slot, determine the edge bias">Keep, and mark another</button>
  </form>
  <div id="references_bar" class="row" hidden><span id="references" class="quiet"></span><button id="forget_references">Forget</button></div>`, { open: true, order: 30 });

const rounded = (value) => (value === null ? null : Number(value.toPrecision(7)));
on("drag_region", "click", () => wantBox("drag_region", "Drag over the part of the picture to look at.", (box) => ask({ do: "region", box })));
on("whole", "click", () => { shown.box = null; ask({ do: "region", box: null }); });
on("drag_reference", "click", () => wantBox("drag_reference", "Drag over the reference, with some background around it.", (box) => {
  shown.box = box;
  at("hint").textContent = "Give the reference's size and press Calibrate.";
  at("size_mm").focus();
}));
on("tips", "change", () => ask({ do: "tips", tips: at("tips").value }));
const height = beside(at("below_tip").closest("div"), inForce({ below_tip: (state) => state.below_tip_mm }));
on("below_tip", "change", () => height({ do: "height", below_tip_mm: number("below_tip") }));
const SIDES = ["region_x", "region_y", "region_w", "region_h"];
submit("region_form", () => ({ do: "region", box: SIDES.map(number) }),
  inForce(Object.fromEntries(SIDES.map((id, i) => [id, (state) => (state.region || [0, 0, state.width_px, state.height_px])[i]]))));
submit("limits_form", () => ({ do: "limits", least: number("least"), greatest: number("greatest") }),
  inForce({ least: (state) => state.least_mm, greatest: (state) => state.greatest_mm }));
submit("scale_form", () => ({ do: "scale", px_per_mm: number("px_per_mm"), u_px_per_mm: number("u_px_per_mm") }),
  inForce({ px_per_mm: (state) => rounded(state.px_per_mm), u_px_per_mm: (state) => rounded(state.u_px_per_mm) }));
on("forget_references", "click", () => ask({ do: "forget_references" }));
submit("calibrate_form", (pressed) => {
  const box = shown.box || (page.state && [0, 0, page.state.width_px, page.state.height_px]);
  shown.box = null;
  at("hint").textContent = "";
  return { do: "calibrate", more: pressed.id === "more_references", box, kind: at("kind").value, size_mm: number("size_mm"), u_size_mm: number("u_size_mm") };
});
listen("state", (state) => {
  const u = state.u_px_per_mm === null ? " px/mm (no uncertainty)" : ` ± ${(2 * state.u_px_per_mm).toFixed(4)} px/mm (k = 2)`;
  say("scale", state.px_per_mm === null ? "not known" : `${state.px_per_mm.toFixed(4)}${u}`);
  at("references_bar").hidden = !state.references.length;
  say("references", `Kept: ${state.references.join("; ")}`);
  if (document.activeElement !== at("tips")) at("tips").value = state.tips;
});
