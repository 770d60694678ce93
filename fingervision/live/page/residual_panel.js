// The residual under the gap, on the same time axis: measured less predicted, with its band; and where it is largest.
import { ask, at, colour, listen, on, page, tell } from "/page/bus.js";
import { gaps, residuals, terms } from "/page/series_data.js";
import { axisOf, bandOf, briefTimes, make as makeChart, placeBefore, plot, redraw, remove, seriesOf, view } from "/page/chart.js";
import { key } from "/page/keys.js";
import { goTo } from "/page/readout.js";

function make() {
  remove(view.residual);
  const shade = "--model";
  view.residual = plot(at("residual_chart"), gaps, {
    axes: [briefTimes(), axisOf(`${terms()[2]} (µm)`)],
    lines: [{}, seriesOf("residual", shade), seriesOf("low"), seriesOf("high")],
    bands: [bandOf(shade)],
    draw: zeroLine,
  });
}
function zeroLine(chart) {
  const y = chart.valToPos(0, "y", true), { left, top, width, height } = chart.bbox;
  if (y < top || y > top + height) return;
  chart.ctx.save();
  chart.ctx.strokeStyle = colour("--quiet");
  chart.ctx.setLineDash([4, 4]);
  chart.ctx.beginPath(); chart.ctx.moveTo(left, y); chart.ctx.lineTo(left + width, y); chart.ctx.stroke();
  chart.ctx.restore();
}
listen("state", ({ model, second }) => {
  // An empty panel tells nothing: beside a model it comes with the first residual, and stays.
  const compared = Boolean(second || (model && (model.rms_um !== null || !at("residual_chart").hidden)));
  if (at("residual_chart").hidden === !compared) return;
  at("residual_chart").hidden = at("worst").hidden = !compared;
  document.body.classList.toggle("modelled", compared);
  makeChart();
  if (compared && !view.residual) make();
});
listen("charted", (from, scale) => {
  if (!view.residual || at("residual_chart").hidden) return;
  view.residual.batch(() => { view.residual.setData(residuals(placeBefore(gaps, from)), false); if (scale) view.residual.setScale("x", scale); });
});
listen("scaled", (min, max) => { if (view.residual) view.residual.setScale("x", { min, max }); });

function worst() {
  let place = -1, most = -1;
  gaps.value.forEach((gap, i) => {
    const size = gap === null || gaps.model[i] === null ? -1 : Math.abs(gap - gaps.model[i]);
    if (size > most) { most = size; place = i; }
  });
  if (place < 0) { tell("message", `No frame has a ${terms()[1]} yet.`, "worst"); return; }
  goTo(place);
  if (page.state.playback) ask({ do: "seek", frame: gaps.frame[place] });
}
on("worst", "click", worst);
key(["w"], "the frame at which the model is worst, or two recordings differ most", () => (at("worst").hidden ? false : worst()));
listen("recoloured", () => { if (view.residual) { make(); redraw(); } });
