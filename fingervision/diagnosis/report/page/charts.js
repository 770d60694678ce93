// Charts of a report: drag or + and - to zoom, arrows to read values, 0 to see all. Needs uPlot on the same page.
"use strict";
(() => {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const colours = () => {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => style.getPropertyValue(name).trim();
    return { ink: read("--ink"), faint: read("--line"), series: [1, 2, 3, 4, 5].map((k) => read(`--series-${k}`)) };
  };
  // Enough digits for a hundredth of a micrometre, and no more.
  const digits = (value) => (value == null ? "" : Number(value.toFixed(5)).toString());

  function draw(figure) {
    const box = document.getElementById(figure.id);
    const readout = box.nextElementSibling;
    const { ink, faint, series: palette } = colours();
    const axis = (label) => ({
      label, stroke: ink, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1 }, labelSize: 22,
    });
    const series = figure.series.map((one) => {
      const colour = one.aside ? "#8a8a8a" : one.colour === 0 ? ink : palette[one.colour - 1];
      return {
        label: one.label,
        stroke: colour,
        width: one.points ? 0 : 1.5,
        dash: one.dash,
        spanGaps: true,
        // Rows left out have no say in the scale: beside them nothing else would be seen.
        auto: !one.aside,
        paths: one.points ? () => null : undefined,
        points: { show: one.points, size: 5, stroke: colour, fill: one.filled ? colour : "transparent" },
      };
    });
    const size = () => ({ width: box.clientWidth, height: Math.round(Math.max(260, Math.min(420, box.clientWidth * 0.55))) });
    const chart = new uPlot(
      {
        ...size(),
        scales: { x: { time: false } },
        axes: [axis(figure.x), { ...axis(figure.y), size: 64 }],
        series: [{ label: figure.x }, ...series],
        // A filled square for filled points, an empty one for open points; lines have the line's dash.
        legend: { live: false, markers: { fill: (u, k) => (k > 0 && figure.series[k - 1].filled ? series[k - 1].stroke : "transparent"),
          dash: (u, k) => (k > 0 && (figure.series[k - 1].dash || []).length ? "dashed" : "solid") } },
        cursor: { drag: { x: true, y: true } },
        hooks: {
          setCursor: [(u) => {
            const at = u.cursor.idx;
            if (at == null) return;
            const read = figure.series
              .map((one, k) => [one.label, u.data[k + 1][at]])
              .filter(([, value]) => value != null)
              .map(([label, value]) => `${label} ${digits(value)}`);
            readout.textContent = `${figure.x} ${digits(u.data[0][at])}: ${read.join("; ")}`;
          }],
        },
      },
      [figure.at, ...figure.series.map((one) => one.values)],
      box,
    );
    const step = (by) => {
      const from = chart.cursor.idx ?? Math.floor(figure.at.length / 2);
      const to = Math.max(0, Math.min(figure.at.length - 1, from + by));
      const row = figure.series.findIndex((one) => one.values[to] != null);
      chart.setCursor({
        left: chart.valToPos(figure.at[to], "x"),
        top: row < 0 ? 0 : chart.valToPos(figure.series[row].values[to], "y"),
      });
    };
    const zoom = (by) => {
      const { min, max } = chart.scales.x;
      const middle = chart.cursor.idx == null ? (min + max) / 2 : figure.at[chart.cursor.idx];
      chart.setScale("x", { min: middle - (middle - min) * by, max: middle + (max - middle) * by });
    };
    box.onkeydown = (event) => {
      const jump = event.shiftKey ? 10 : 1;
      const acts = {
        ArrowRight: () => step(jump), ArrowLeft: () => step(-jump), "+": () => zoom(0.7), "-": () => zoom(1 / 0.7),
        0: () => chart.setData(chart.data),
      };
      if (acts[event.key]) {
        acts[event.key]();
        event.preventDefault();
      }
    };
    return { chart, size };
  }

  let drawn = figures.map(draw);
  const again = () => {
    for (const { chart } of drawn) chart.destroy();
    drawn = figures.map(draw);
  };
  dark.addEventListener("change", again);
  window.addEventListener("resize", () => drawn.forEach(({ chart, size }) => chart.setSize(size())));
})();
