// The table as CSV, and the chart as a picture with its title.
import { colour, download, on, page, tell, withToken } from "/page/bus.js";
import { view } from "/page/chart.js";

const TITLE_PX = 26;
on("save_csv", "click", () => download(withToken("/gaps.csv"), "gaps.csv"));
on("save_plot", "click", () => {
  const drawn = view.chart.root.querySelector("canvas"), sheet = document.createElement("canvas"), ratio = devicePixelRatio;
  sheet.width = drawn.width;
  sheet.height = drawn.height + TITLE_PX * ratio;
  const ink = sheet.getContext("2d");
  ink.fillStyle = colour("--card");
  ink.fillRect(0, 0, sheet.width, sheet.height);
  ink.fillStyle = colour("--ink");
  ink.font = `${13 * ratio}px system-ui, sans-serif`;
  const zero = page.state && page.state.zero_mm ? `, less zero ${page.state.zero_mm.toFixed(4)} mm` : "";
  ink.fillText(`Gap of ${page.state ? page.state.source : ""}${zero}; band: k = 2; ${new Date().toISOString()}`, 8 * ratio, 17 * ratio);
  ink.drawImage(drawn, 0, TITLE_PX * ratio);
  sheet.toBlob((blob) => {
    const address = URL.createObjectURL(blob);
    download(address, "gap.png");
    setTimeout(() => URL.revokeObjectURL(address), 60000);
    tell("message", "The plot was saved as it is shown, as gap.png.", "save_plot");
  });
});
