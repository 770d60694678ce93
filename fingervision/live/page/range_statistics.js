// What a range of the chart says: mean and slope of the gap with their uncertainty (k = 2), its change, and the model's
// residual. Noise from frame to frame averages out; what is common to all frames does not. Of that, what grows with the gap
// (scale, distance from the calibrated plane, tilt) is an error of every change too; a constant part cancels there.
const sum = (values) => values.reduce((total, value) => total + value, 0);
const mean = (values) => sum(values) / values.length, rms = (values) => Math.sqrt(mean(values.map((each) => each ** 2)));

// Relative standard uncertainty of a change: the slope of the common variances over the squares of the gaps. Where the gaps
// do not tell it, all of the common part is taken to grow with the gap.
function ofChanges(gap, common) {
  const square = gap.map((each) => each ** 2), square_0 = mean(square), common_0 = mean(common);
  const spread = sum(square.map((each) => (each - square_0) ** 2)), most = common_0 / square_0;
  const slope = spread > 1e-6 * square_0 ** 2 ? sum(square.map((each, k) => (each - square_0) * (common[k] - common_0))) / spread : most;
  return Math.sqrt(Math.min(most, Math.max(0, slope)) || 0);
}

// `columns` as in series_data.
export function statistics(columns, from, to) {
  const places = columns.time.flatMap((time, i) => (time >= from && time <= to && columns.value[i] !== null ? [i] : []));
  if (places.length < 2) return null;
  const of = (name) => places.map((i) => columns[name][i]), time = of("time"), gap = of("value");
  const u = places.map((i) => (columns.high[i] - columns.value[i]) / 2), random = places.map((i, k) => columns.random[i] ?? u[k]);
  const n = places.length, time_0 = mean(time), gap_0 = mean(gap), spread = sum(time.map((t) => (t - time_0) ** 2));
  const slope = sum(time.map((t, k) => (t - time_0) * (gap[k] - gap_0))) / spread;
  const noise = mean(random.map((each) => each ** 2)), fixed = Math.max(0, mean(u.map((each) => each ** 2)) - noise);
  const relative = ofChanges(gap, u.map((each, k) => Math.max(0, each ** 2 - random[k] ** 2)));
  const rest = n > 2 ? sum(time.map((t, k) => (gap[k] - gap_0 - slope * (t - time_0)) ** 2)) / (n - 2) : 0;
  // Where the gap does not follow a line, what is left over widens the slope's uncertainty, as it does not follow one.
  const U_slope = 2 * Math.hypot(Math.sqrt(Math.max(rest, noise) / spread), slope * relative);
  const residual = places.flatMap((i) => (columns.model[i] === null ? [] : [columns.value[i] - columns.model[i]]));
  // How much of the difference of two recordings is common to all frames is not known: nothing is taken to average out.
  const u_difference = places.flatMap((i) => (columns.u_difference[i] === null ? [] : [columns.u_difference[i]]));
  return {
    n, from: time[0], to: time[n - 1], first: columns.frame[places[0]], last: columns.frame[places[n - 1]],
    mean: gap_0, U_mean: 2 * Math.sqrt(noise / n + fixed), slope, U_slope,
    change: gap[n - 1] - gap[0], U_change: 2 * Math.hypot(random[0], random[n - 1], (gap[n - 1] - gap[0]) * relative),
    least: gap.reduce((a, b) => Math.min(a, b)), greatest: gap.reduce((a, b) => Math.max(a, b)),
    residual: residual.length ? { n: residual.length, mean: mean(residual), rms: rms(residual), U_mean: u_difference.length ? 2 * rms(u_difference) : null } : null,
  };
}
