// Zoom and pan of the picture: by wheel, pinch, drag, buttons and keys. The stage is laid out larger, not transformed, so
// that lines and letters drawn over it keep their width at any zoom.
import { at, listen, on, page, say, tell } from "/page/bus.js";
import { key } from "/page/keys.js";

const STEP = 1.5, MOST = 40, WHEEL = 0.0015, PAN_SHARE = 0.15, CRISP_PX = 3;
// `x` and `y` are the place of the picture (0 to 1 in each direction) that stands in the middle of its frame.
export const seen = { zoom: 1, x: 0.5, y: 0.5 };
const stage = () => at("stage"), clamp = (value, low, high) => Math.min(high, Math.max(low, value));

// Show a picture (a JPEG file) with what was measured in it.
export async function draw(bytes, overlay) {
  const canvas = at("picture");
  try {
    const picture = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
    if (canvas.width !== picture.width || canvas.height !== picture.height) {
      canvas.width = picture.width;
      canvas.height = picture.height;
    }
    at("stage").style.setProperty("--aspect", String(picture.width / picture.height));
    canvas.getContext("2d").drawImage(picture, 0, 0);
    picture.close();
    page.overlay = overlay; // of this picture, and of no other
    canvas.dataset.shown = String(Number(canvas.dataset.shown || 0) + 1);
    tell("picture");
  } catch { tell("message", "A picture could not be shown.", "picture"); }
}

// Screen pixels of one pixel of the picture.
export const scale = () => stage().clientWidth / at("picture").width;

function show() {
  const { style } = stage(), frame = at("frame");
  style.setProperty("--zoom", String(seen.zoom));
  const inside = (at_share, room, length) => { const half = room / (2 * length); return half >= 0.5 ? 0.5 : clamp(at_share, half, 1 - half); };
  seen.x = inside(seen.x, frame.clientWidth, stage().clientWidth);
  seen.y = inside(seen.y, frame.clientHeight, stage().clientHeight);
  style.setProperty("--x", `${-100 * seen.x}%`);
  style.setProperty("--y", `${-100 * seen.y}%`);
  stage().classList.toggle("zoomed", seen.zoom > 1);
  at("picture").classList.toggle("crisp", scale() >= CRISP_PX);
  say("zoom_words", `${seen.zoom < 10 ? seen.zoom.toFixed(1) : seen.zoom.toFixed(0)}×`);
  at("picture_smaller").disabled = at("fit").disabled = seen.zoom === 1;
  tell("zoomed");
}
// Share of the picture under a point of the window.
function under(x, y) {
  const { left, top, width, height } = stage().getBoundingClientRect();
  return [(x - left) / width, (y - top) / height];
}
export function zoomBy(factor, x = null, y = null) {
  const before = seen.zoom, about = x === null ? [seen.x, seen.y] : under(x, y);
  seen.zoom = clamp(before * factor, 1, MOST);
  if (seen.zoom < 1.01) seen.zoom = 1;
  const kept = before / seen.zoom; // what is under the pointer stays there
  seen.x = about[0] + (seen.x - about[0]) * kept;
  seen.y = about[1] + (seen.y - about[1]) * kept;
  show();
}
export function fit() { Object.assign(seen, { zoom: 1, x: 0.5, y: 0.5 }); show(); }
function panBy(x, y) { // in screen pixels
  seen.x -= x / stage().clientWidth;
  seen.y -= y / stage().clientHeight;
  show();
}

const fingers = new Map();
const middle = () => { const all = [...fingers.values()]; return [0, 1].map((i) => all.reduce((sum, each) => sum + each[i], 0) / all.length); };
const spread = () => { const [a, b] = [...fingers.values()]; return b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0; };
function letGo(event) { fingers.delete(event.pointerId); stage().classList.toggle("panned", fingers.size > 0); }
listen("start", () => {
  const frame = at("frame");
  frame.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomBy(Math.exp(-event.deltaY * WHEEL * (event.deltaMode === 1 ? 16 : 1) * (event.ctrlKey ? 4 : 1)), event.clientX, event.clientY);
  }, { passive: false });
  frame.addEventListener("pointerdown", (event) => {
    // A box or a gauge that is being drawn takes the drag for itself.
    if (event.defaultPrevented || stage().classList.contains("dragging") || at("gauge_drawing").classList.contains("drawing")) return;
    if (event.pointerType === "mouse" && seen.zoom === 1) return;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size > 1 || seen.zoom > 1) { frame.setPointerCapture(event.pointerId); stage().classList.add("panned"); }
  });
  frame.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    const [x, y] = middle(), wide = spread();
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    const [to_x, to_y] = middle();
    if (seen.zoom > 1) panBy(to_x - x, to_y - y);
    if (wide > 0) zoomBy(spread() / wide, to_x, to_y);
  });
  for (const end of ["pointerup", "pointercancel"]) frame.addEventListener(end, letGo);
  frame.addEventListener("dblclick", fit);
  frame.addEventListener("mousedown", (event) => event.preventDefault()); // a click leaves the arrows to the frames
  frame.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (way && seen.zoom > 1) panBy(way[0] * PAN_SHARE * frame.clientWidth, way[1] * PAN_SHARE * frame.clientHeight);
    else if (event.key === "+" || event.key === "-") zoomBy(event.key === "+" ? STEP : 1 / STEP);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  new ResizeObserver(show).observe(frame);
});
on("picture_larger", "click", () => zoomBy(STEP));
on("picture_smaller", "click", () => zoomBy(1 / STEP));
on("fit", "click", fit);
key(["e", "d"], "enlarge the picture, and back; with the picture in focus arrows move it", (event) => zoomBy(event.key === "e" ? STEP : 1 / STEP));
key(["0"], "fit the picture into its frame", fit);
