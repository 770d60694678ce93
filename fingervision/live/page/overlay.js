// The measured points over the picture: edges, tips, gap, held part; drawn as lines of constant width at any zoom.
import { at, listen, page } from "/page/bus.js";
import { scale } from "/page/picture_view.js";

const EDGE_PX = 19, TIP_PX = 26, POINT_PX = 6; // half lengths, on the screen
const svg = at("overlay");
function line(kind, ...points) {
  const path = document.createElementNS(svg.namespaceURI, "path");
  path.setAttribute("d", points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(3)} ${y.toFixed(3)}`).join(""));
  path.setAttribute("class", kind);
  svg.append(path);
}
// Unit vector along an edge at its measuring point; `slope` is across the fingers per pixel along them.
export function along({ vertical, root }, [, , , slope]) {
  const steep = Math.hypot(1, slope), step = [slope / steep, root / steep];
  return vertical ? step : [step[1], step[0]];
}
function draw() {
  svg.replaceChildren();
  const found = page.overlay, unit = 1 / scale(), { width, height } = at("picture");
  if (!found || !Number.isFinite(unit)) return;
  svg.setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`); // whole coordinates are pixels' middles
  if (found.held) line("held", found.held.slice(0, 2), found.held.slice(2));
  if (!found.edges) return;
  line("distance", ...found.edges.map(([x, y]) => [x, y]));
  for (const edge of found.edges) {
    const [x, y, tip] = edge, [dx, dy] = along(found, edge), half = EDGE_PX * unit, wide = TIP_PX * unit, arm = POINT_PX * unit;
    line("edge", [x - half * dx, y - half * dy], [x + half * dx, y + half * dy]);
    if (found.vertical) line("tip", [x - wide, tip], [x + wide, tip]);
    else line("tip", [tip, y - wide], [tip, y + wide]);
    line("point", [x - arm, y], [x + arm, y]);
    line("point", [x, y - arm], [x, y + arm]);
  }
}
listen("picture", draw);
listen("zoomed", draw);
