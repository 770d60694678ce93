// A magnifier at each measuring point: the pixels as they are, with the edge that was found among them.
import { at, listen, on, page } from "/page/bus.js";
import { along } from "/page/overlay.js";
import { key } from "/page/keys.js";

const AROUND_PX = 20, SIDE = 320;
const lenses = [at("lens_left"), at("lens_right")];
let shown = false;
function draw() {
  const edges = shown && page.overlay && page.overlay.edges;
  lenses.forEach((lens, i) => {
    lens.hidden = !edges;
    if (!edges) return;
    const [x, y] = edges[i], ink = lens.getContext("2d"), unit = SIDE / AROUND_PX, half = SIDE / 2;
    lens.width = lens.height = SIDE;
    ink.imageSmoothingEnabled = false;
    // A pixel's middle has a whole coordinate, its corner half a pixel less.
    ink.drawImage(at("picture"), x + 0.5 - AROUND_PX / 2, y + 0.5 - AROUND_PX / 2, AROUND_PX, AROUND_PX, 0, 0, SIDE, SIDE);
    const [dx, dy] = along(page.overlay, edges[i]);
    ink.lineWidth = 2;
    ink.strokeStyle = "#40c8ff";
    ink.beginPath(); ink.moveTo(half - SIDE * dx, half - SIDE * dy); ink.lineTo(half + SIDE * dx, half + SIDE * dy); ink.stroke();
    ink.strokeStyle = "#ff4040";
    ink.beginPath(); ink.moveTo(half - unit, half); ink.lineTo(half + unit, half); ink.moveTo(half, half - unit); ink.lineTo(half, half + unit); ink.stroke();
  });
}
on("magnifier", "click", () => {
  shown = !shown;
  at("magnifier").setAttribute("aria-pressed", String(shown));
  draw();
});
key(["l"], "magnifiers at the two measuring points", () => at("magnifier").click());
listen("picture", draw);
