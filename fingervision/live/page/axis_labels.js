// Labels of a chart's axis: as many decimals as its steps need, so that no two say the same, and room for them.
const MOST_DECIMALS = 9, LETTER_PX = 7, BESIDE_PX = 23;
export function decimals(step) {
  let digits = 0;
  while (digits < MOST_DECIMALS && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6) digits += 1;
  return digits;
}
export const values = (chart, places, axis, room, step) => places.map((at) => at.toFixed(decimals(step)));
// Charts under each other have the same room beside them, so that a time stands at the same place in each.
const charts = new Map();
export function wide(chart, labels) {
  const own = BESIDE_PX + LETTER_PX * Math.max(4, ...(labels || []).map((label) => label.length));
  for (const each of charts.keys()) if (each !== chart && !each.root.offsetParent) charts.delete(each); // gone, or hidden
  const room = Math.max(own, ...[...charts].map(([each, its]) => (each === chart ? 0 : its.own)));
  charts.set(chart, { own, room });
  for (const [each, its] of charts) if (its.room !== room) queueMicrotask(() => each.redraw(false, true));
  return room;
}
