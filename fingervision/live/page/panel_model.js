// The model beside the measurement: size of the residual, and what diagnose says of it so far.
import { ask, at, download, listen, number, on, page, panel, say, submit, withToken } from "/page/bus.js";

panel("against", 'Model: <span id="model_residual" class="quiet"></span>', `
  <p id="verdict_words" role="status"></p>
  <ul id="verdict_effects"></ul>
  <details id="verdict_why" hidden><summary>Why</summary><p id="verdict_more"></p><img id="verdict_picture" alt="Measured less predicted gap before and after the named effects"></details>
  <p id="verdict_next" hidden></p>
  <div class="row"><button id="next_run" hidden>Run what would settle it</button><button id="verdict_report" hidden>Save the full report</button></div>
  <p id="model_words" class="quiet"></p>
  <form id="input_form" class="row">
    <label>input now <input id="typed_input" type="text" inputmode="decimal" autocomplete="off"> mm</label>
    <button>Set</button>
  </form>`, { open: true, order: 6 });
at("against").hidden = true;
submit("input_form", () => ({ do: "input", input_mm: number("typed_input") }));
on("verdict_report", "click", () => download(withToken("/verdict/report.html"), "report.html"));
function picture() { // of the newest verdict, and only when it is looked at
  const verdict = page.state && page.state.model && page.state.model.verdict, address = verdict && withToken(`/verdict/residuals.svg?of=${encodeURIComponent(verdict.report)}`);
  if (verdict && at("verdict_why").open && at("verdict_picture").getAttribute("src") !== address) at("verdict_picture").src = address;
}
on("verdict_why", "toggle", picture);
const NEXT = {
  agrees: "Nothing has to be done; a smaller effect than those that the report lists would not be seen.",
  named: "The full report has the effect's size and the model with it.",
  ambiguous: "Another run would settle which of them it is.",
  unknown: "No effect of the catalogue explains it: look at the frames where the model is worst (w), and at the set-up.",
};
on("next_run", "click", () => ask({ do: "bed_run", recipe: page.state.model.verdict.next_run }));

const um = (value) => (value === null ? "–" : `${value.toFixed(1)} µm`);
listen("state", ({ model, bed, whole }) => {
  at("against").hidden = !model;
  if (!model) return;
  const last = model.recent < model.samples ? `last ${model.recent}: ` : "";
  say("model_residual", model.rms_um === null ? "no residual yet" : `${last}mean residual ${um(model.mean_um)}, RMS ${um(model.rms_um)}`);
  // Of a live view the newest row's; of a recording it would be the last row's, whichever frame is shown.
  const unknown = whole ? "A residual needs measured frames, and the log of the drive with the recording. " : "The input is not known yet: no residual is shown. ";
  const input = model.input_mm === null ? unknown : whole ? "" : `Input ${model.input_mm.toFixed(4)} mm. `;
  say("model_words", `${input}${model.samples} samples against ${model.path}${model.band_um === null ? "" : `; U of one sample ${um(model.band_um)} (k = 2)`}.`);
  const { verdict } = model;
  const waits = model.busy ? "diagnose is at work…" : `A verdict needs 100 samples in motion, there and back: so far ${model.moved}.`;
  // The verdict is its first sentence; what the rest adds is said where one asks why.
  const [first, ...rest] = verdict ? verdict.sentence.split(/(?<=\.) /) : [waits];
  say("verdict_words", verdict ? `${verdict.verdict}: ${first}${model.busy ? " (being judged anew)" : ""}` : first);
  at("verdict_why").hidden = at("verdict_next").hidden = at("verdict_report").hidden = !verdict;
  if (verdict) {
    const recipe = verdict.next_run && !(bed && bed.movable) ? ` Its recipe: ${verdict.next_run}` : "";
    say("verdict_next", `What next: ${NEXT[verdict.verdict] || ""}${recipe}`);
    say("verdict_more", [...rest, `From ${verdict.rows} samples.`].join(" "));
    // Effects that explain only a part are no verdict.
    at(verdict.verdict === "unknown" ? "verdict_more" : "verdict_words").after(at("verdict_effects"));
    picture();
  }
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
