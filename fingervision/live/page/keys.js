// Keys for everything, and the page of help that lists them.
import { at, listen, on, tell } from "/page/bus.js";
import { all, zoom } from "/page/chart.js";
import { move } from "/page/readout.js";

const ZOOM = 1.6, MANY = 25;
const press = (id) => () => { if (at(id) && !at(id).disabled && at(id).offsetParent !== null) at(id).click(); };
const help = [];
const table = new Map();
// Scripts of other concerns add theirs; the newest comes first, and one that gives back false leaves the key to others.
export function key(names, words, act) {
  for (const name of names) table.set(name, [act, ...(table.get(name) || [])]);
  help.push([names, words]);
}
const called = { " ": "Space", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓" };

key(["?"], "this page of help", () => showHelp());
key([" ", "p"], "pause the view, and go on; play a recording", press("pause"));
key(["ArrowLeft", "ArrowRight"], "read the chart sample by sample (with Shift by 25); step through a recording", (event) => move((event.key === "ArrowLeft" ? -1 : 1) * (event.shiftKey ? MANY : 1)));
key(["ArrowUp", "+"], "zoom the chart in", () => zoom(1 / ZOOM));
key(["ArrowDown", "-"], "zoom the chart out", () => zoom(ZOOM));
key(["a"], "the whole chart", all);
key(["f"], "follow the newest", press("follow"));
key(["r"], "record, and stop recording", press("record"));
key(["s"], "snapshot", press("snapshot"));
key(["z"], "zero; again: zero off", () => press(at("unzero").hidden ? "zero" : "unzero")());
key(["i"], "steps of the image processing", press("steps"));
key(["c"], "save the table as CSV", press("save_csv"));
key(["g"], "save the plot as PNG", press("save_plot"));
key(["Escape"], "leave a field, let go of a drag", (event) => {
  if (document.activeElement) document.activeElement.blur(); // back to the single keys
  tell("escape", event);
});

function showHelp() {
  const list = at("help_keys");
  list.replaceChildren();
  for (const [names, words] of help) {
    const term = document.createElement("dt"), meaning = document.createElement("dd");
    for (const name of names) {
      const cap = document.createElement("kbd");
      cap.textContent = called[name] || name;
      term.append(cap, " ");
    }
    meaning.textContent = words;
    list.append(term, meaning);
  }
  at("help_dialog").showModal();
}
on("help", "click", showHelp);

listen("start", () => document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const tag = event.target.tagName;
  if (event.key !== "Escape") {
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(tag) || at("help_dialog").open) return;
    if (event.key === " " && /^(BUTTON|SUMMARY|A)$/.test(tag)) return;
    if (/^Arrow(Up|Down)$/.test(event.key) && event.target.closest("#panels")) return; // it scrolls
  }
  for (const act of table.get(event.key) || []) {
    if (act(event) !== false) { if (event.key !== "Escape") event.preventDefault(); return; }
  }
}));
