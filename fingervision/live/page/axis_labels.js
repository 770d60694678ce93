// Labels of a chart's axis: as many decimals as its steps need, so that no two say the same, and room for them.
const MOST_DECIMALS = 9, LETTER_PX = 7, BESIDE_PX = 17;
export function decimals(step) {
  let digits = 0;
  while (digits < MOST_DECIMALS && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6) digits += 1;
  return digits;
}
export const values = (chart, places, axis, room, step) => places.map((at) => at.toFixed(decimals(step)));
export const wide = (chart, labels) => BESIDE_PX + LETTER_PX * Math.max(4, ...(labels || []).map((label) => label.length));
