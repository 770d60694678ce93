// Within the set-up: what the camera lets be set while it runs; what it refuses is said beside the field.
import "/page/panel_set_up.js";
import { ask, at, listen, typed } from "/page/bus.js";

const TITLES = { exposure: "Exposure", gain: "Gain", focus: "Focus", "white balance": "White balance", "frame rate": "Frame rate" };
at("set_up").insertAdjacentHTML("beforeend", '<fieldset id="camera_controls" hidden><legend>Camera, while it runs</legend></fieldset>');
const fields = new Map();
let built = "";

const figure = (value) => String(Number(value.toPrecision(4)));
function limits({ least, greatest, unit }) {
  if (least === null && greatest === null) return unit;
  const ends = least === null ? `up to ${figure(greatest)}` : greatest === null ? `from ${figure(least)}` : `${figure(least)} to ${figure(greatest)}`;
  return `${ends} ${unit}`.trim();
}
function build(controls) {
  fields.clear();
  for (const each of [...at("camera_controls").children].slice(1)) each.remove();
  controls.forEach((control, number) => {
    const form = document.createElement("form"), label = document.createElement("label"), input = document.createElement("input");
    const about = document.createElement("span"), button = document.createElement("button"), words = document.createElement("p");
    form.className = "row";
    form.noValidate = true; // the server says in a sentence what the camera takes
    Object.assign(input, { inputMode: "decimal", autocomplete: "off", id: `camera_${number}` });
    input.setAttribute("aria-describedby", `camera_about_${number} camera_words_${number}`);
    Object.assign(about, { className: "quiet", id: `camera_about_${number}`, textContent: limits(control) });
    button.textContent = "Set";
    button.setAttribute("aria-label", `Set ${control.name}`);
    Object.assign(words, { className: "refused", id: `camera_words_${number}` });
    words.setAttribute("role", "status");
    label.append(TITLES[control.name] || control.name, " ", input);
    form.append(label, about, button);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      words.textContent = "";
      ask({ do: "set_camera", name: control.name, value: typed(input.value) });
    });
    at("camera_controls").append(form, words);
    fields.set(control.name, { input, button, words, value: null });
  });
}
listen("state", ({ camera_controls: controls = [], viewer, holds_pen: holds }) => {
  at("camera_controls").hidden = controls.length === 0;
  const key = JSON.stringify(controls.map(({ value, ...rest }) => rest));
  if (key !== built) { built = key; build(controls); }
  for (const { name, value } of controls) {
    const field = fields.get(name);
    // What is being typed stays until the camera has another value.
    if (field.value !== value) { field.value = value; field.input.value = figure(value); }
    field.input.disabled = field.button.disabled = viewer || holds === false;
  }
});
listen("reply", (reply) => {
  if (reply.do !== "set_camera") return;
  const field = fields.get(reply.field || reply.name);
  if (!field) return;
  field.words.textContent = reply.refused || "";
  if (!reply.refused) { field.value = reply.value; field.input.value = figure(reply.value); }
});
