// A small chart of each quantity of each gauge, on the time axis of the gap, with its value in the frame that is shown.
import { at, listen, page } from "/page/bus.js";
import { axisOf, bandOf, briefTimes, columnsOf, plot, remove, seriesOf, view } from "/page/chart.js";
import { drawFailures } from "/page/chart_failures.js";
import { gaugeSeries, nameOf, nearest, saidOf } from "/page/series_data.js";

const made = new Map(); // by series: its figure, chart and words
function chartOf(place, series) {
  const chart = plot(place, series, {
    axes: [briefTimes(), { ...axisOf(series.unit), label: null, space: 18 }],
    lines: [{}, seriesOf(nameOf(series), "--accent"), seriesOf("− U"), seriesOf("+ U")],
    bands: [bandOf("--accent")],
    draw: (drawn) => drawFailures(drawn, series),
    scrolls: true,
  });
  const { min, max } = view.chart.scales.x;
  if (min !== null) chart.setScale("x", { min, max });
  return chart;
}
function build() {
  const all = gaugeSeries(), box = at("gauge_charts");
  for (const [series, { figure, chart }] of made) if (!all.includes(series)) { remove(chart); figure.remove(); made.delete(series); }
  box.hidden = !all.length;
  document.body.classList.toggle("gauged", all.length > 0);
  for (const series of all) {
    if (!made.has(series)) {
      const figure = document.createElement("figure"), head = document.createElement("figcaption"), place = document.createElement("div"), name = document.createElement("b"), words = document.createElement("span");
      head.append(name, " ", words);
      place.setAttribute("role", "img");
      figure.append(head, place);
      box.append(figure);
      made.set(series, { figure, place, name, words, chart: chartOf(place, series) });
    }
    const { figure, place, name } = made.get(series), title = `${nameOf(series)} (${series.unit})`;
    name.textContent = title;
    place.setAttribute("aria-label", `${title} over time`);
    box.append(figure); // in the order of the gauges
  }
  view.dirty = true;
}
function say() {
  for (const [series, { words }] of made) {
    const i = page.now ? nearest(page.now.time_s ?? page.now.frame, series) : -1, is = i >= 0 && series.frame[i] === page.now.frame;
    words.textContent = is ? saidOf(series, i) : "";
    words.className = is && series.value[i] === null ? "bad" : "quiet";
  }
}
listen("gauges", build);
listen("now", say);
listen("charted", (from, scale) => {
  for (const [series, { chart }] of made) chart.batch(() => { chart.setData(columnsOf(series, from), false); if (scale) chart.setScale("x", scale); });
  say();
});
listen("scaled", (min, max) => { for (const { chart } of made.values()) chart.setScale("x", { min, max }); });
listen("recoloured", () => {
  for (const [series, each] of made) { remove(each.chart); each.chart = chartOf(each.place, series); }
  view.dirty = true;
});
