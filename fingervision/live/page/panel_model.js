// The model beside the measurement: residual with its band, and what diagnose says of it so far.
import { ask, at, colour, listen, number, on, page, panel, say, submit } from "/page/bus.js";
import { gaps } from "/page/gap_data.js";
import { values, wide } from "/page/axis_labels.js";

const HIGH_PX = 140, WINDOW_S = 30, DRAWN_EVERY_MS = 250;
panel("against", 'Model: <span id="model_residual" class="quiet"></span>', `
  <p id="verdict_words" role="status"></p>
  <ul id="verdict_effects"></ul>
  <button id="next_run" hidden>Run what would settle it</button>
  <div id="residual_chart" role="img" aria-label="Residual over time: measured less predicted, with its band"></div>
  <p id="model_words" class="quiet"></p>
  <form id="input_form" class="row">
    <label>input now <input id="typed_input" type="text" inputmode="decimal" autocomplete="off"> mm</label>
    <button>Set</button>
  </form>`, { open: true, order: 6 });
at("against").hidden = true;
submit("input_form", () => ({ do: "input", input_mm: number("typed_input") }));
on("next_run", "click", () => ask({ do: "bed_run", recipe: page.state.model.verdict.next_run }));

const um = (value) => (value === null ? "–" : `${value.toFixed(1)} µm`);
listen("state", ({ model, bed, whole }) => {
  at("against").hidden = !model;
  if (!model) return;
  say("model_residual", model.rms_um === null ? "no residual yet" : `mean residual ${um(model.mean_um)}, RMS ${um(model.rms_um)}`);
  const input = model.input_mm === null ? "The input is not known yet." : `Input ${model.input_mm.toFixed(4)} mm.`;
  say("model_words", `${input} ${model.samples} samples against ${model.path}${model.band_um === null ? "" : `; U of one sample ${um(model.band_um)} (k = 2)`}.`);
  const { verdict } = model;
  const waits = model.busy ? "diagnose is at work…" : `A verdict needs 100 samples in motion, there and back: so far ${model.moved}.`;
  say("verdict_words", verdict ? `${verdict.verdict}: ${verdict.sentence} (${verdict.rows} samples)${model.busy ? " – being judged anew" : ""}` : waits);
  const effects = verdict ? verdict.effects.map(([name, values]) => `${name}: ${values}`) : [];
  if (at("verdict_effects").dataset.shown !== effects.join("\n")) {
    at("verdict_effects").dataset.shown = effects.join("\n");
    at("verdict_effects").replaceChildren(...effects.map((words) => {
      const item = document.createElement("li");
      item.textContent = words;
      return item;
    }));
  }
  at("next_run").hidden = !verdict || !verdict.next_run || !bed || !bed.movable;
  at("next_run").disabled = Boolean(bed && bed.doing);
  at("input_form").hidden = Boolean(bed) || whole;
});

let chart = null, drawnAt = 0;
function make() {
  if (chart) chart.destroy();
  const ink = colour("--ink"), line = colour("--line"), shade = colour("--model");
  const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 }, font: "11px system-ui, sans-serif" };
  const hidden = { stroke: "transparent", points: { show: false } };
  chart = new uPlot({
    width: at("residual_chart").clientWidth || 300, height: HIGH_PX, legend: { show: false }, cursor: { show: false },
    scales: { x: { time: false } },
    axes: [{ ...axis, size: 30, values }, { ...axis, size: wide, values, label: "residual (µm)", labelSize: 16, labelFont: "11px system-ui, sans-serif" }],
    series: [{}, { stroke: shade, width: 1.3, points: { show: false } }, hidden, hidden],
    bands: [{ series: [3, 2], fill: `${shade}44` }],
  }, [[], [], [], []], at("residual_chart"));
}
function draw() {
  if (at("against").hidden || !at("against").open || page.paused || performance.now() - drawnAt < DRAWN_EVERY_MS) return;
  drawnAt = performance.now();
  if (!chart) make();
  const wide = at("residual_chart").clientWidth;
  if (wide && wide !== chart.width) chart.setSize({ width: wide, height: HIGH_PX });
  const count = gaps.time.length, whole = page.state.whole;
  let from = 0;
  if (!whole && count) { from = gaps.time.findIndex((time) => time >= gaps.time[count - 1] - WINDOW_S); }
  const rows = [[], [], [], []];
  for (let i = from; i < count; i += 1) {
    const known = gaps.gap[i] !== null && gaps.model[i] !== null, value = known ? 1000 * (gaps.gap[i] - gaps.model[i]) : null;
    const half = known ? 1000 * (gaps.high[i] - gaps.gap[i]) : null;
    rows[0].push(gaps.time[i]); rows[1].push(value); rows[2].push(known ? value - half : null); rows[3].push(known ? value + half : null);
  }
  chart.setData(rows);
}
listen("changed", draw);
listen("start", () => matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { if (chart) make(); }));
