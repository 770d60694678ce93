// Boxes in the picture, by mouse, finger or pen: whoever wants one asks for it, and gets it in the frame's own pixels.
import { at, listen, page } from "/page/bus.js";

const LEAST_PX = 8;
let start = null, wanted = null;
export const shown = { box: null };
const canvas = () => at("picture");

// `button` shows that it waits; `act` gets [column, row, width, height], and where the drag ended.
export function wantBox(button, words, act) {
  const same = wanted && wanted.button === button;
  cancel();
  if (same) return;
  wanted = { button, act };
  at("stage").classList.add("dragging");
  at(button).setAttribute("aria-pressed", "true");
  at("hint").textContent = words;
}
export function cancel() {
  if (wanted) at(wanted.button).setAttribute("aria-pressed", "false");
  start = wanted = null;
  at("stage").classList.remove("dragging");
  at("hint").textContent = "";
}
export function showBox(box) {
  at("box").hidden = !box;
  if (!box) return;
  const share = (value, of) => `${(100 * value) / of}%`, style = at("box").style, { width, height } = canvas();
  style.left = share(box[0], width); style.top = share(box[1], height);
  style.width = share(box[2], width); style.height = share(box[3], height);
}
function inPicture(event) {
  const frame = canvas().getBoundingClientRect(), { width, height } = canvas();
  const x = ((event.clientX - frame.left) / frame.width) * width, y = ((event.clientY - frame.top) / frame.height) * height;
  return [Math.min(width, Math.max(0, x)), Math.min(height, Math.max(0, y))];
}
function boxOf([x0, y0], [x1, y1]) {
  const x = Math.round(Math.min(x0, x1)), y = Math.round(Math.min(y0, y1));
  return [x, y, Math.round(Math.max(x0, x1)) - x, Math.round(Math.max(y0, y1)) - y];
}
listen("start", () => {
  canvas().addEventListener("pointerdown", (event) => {
    if (!wanted) return;
    start = inPicture(event);
    canvas().setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  canvas().addEventListener("pointermove", (event) => { if (start) showBox(boxOf(start, inPicture(event))); });
  canvas().addEventListener("pointerup", (event) => {
    if (!start) return;
    const end = inPicture(event), box = boxOf(start, end), { act, button } = wanted;
    if (button !== "drag_height" && (box[2] < LEAST_PX || box[3] < LEAST_PX)) { // said where it is drawn, and drawn again
      start = null;
      showBox(shown.box || (page.state && page.state.region));
      at("hint").textContent = `That was ${box[2]}×${box[3]} pixels: drag over at least ${LEAST_PX} each way, or leave it with Escape.`;
      return;
    }
    cancel();
    act(box, end);
  });
  canvas().addEventListener("pointercancel", cancel);
});
listen("state", (state) => { if (!start) showBox(shown.box || state.region); });
listen("escape", () => { cancel(); shown.box = null; showBox(page.state ? page.state.region : null); });
