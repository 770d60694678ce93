// Gauges of one's own on a recording: added, drawn, typed, named, removed, saved; what each says of the frame shown.
import { ask, at, listen, on, page, panel, say, typed as number } from "/page/bus.js";
import { board, change, chosen, isFirst, request, tables, told, usual, works } from "/page/gauge_board.js";
import { add, beginDrawing, draw, drawing, onChosen, stopDrawing } from "/page/gauge_drawing.js";

const MOVES = { ArrowLeft: ["x_px", -1], ArrowRight: ["x_px", 1], ArrowUp: ["y_px", -1], ArrowDown: ["y_px", 1] }, MANY_PX = 10;
panel("gauges", 'Gauges <span id="gauge_file" class="quiet"></span>', `
  <form id="gauge_add" class="row">
    <label>Kind <select id="gauge_kind"></select></label>
    <label>Name <input id="gauge_new_name" size="6" maxlength="100" autocomplete="off"></label>
    <button id="gauge_draw" type="button" aria-pressed="false">Draw</button>
    <button id="gauge_add_here">Add</button>
  </form>
  <div class="row">
    <button id="gauge_first" type="button" hidden>First frame</button>
    <button id="gauge_save" type="button">Save gauges</button>
    <button id="gauge_over" type="button" hidden>Save over it</button>
    <button id="gauge_load" type="button">Load file</button>
    <span id="gauge_saved" class="quiet"></span>
  </div>
  <p id="gauge_words" class="refused" role="status"></p>
  <p id="gauge_hint" class="quiet"></p>
  <ul id="gauge_list" aria-label="Gauges"></ul>
  <form id="gauge_form" hidden><fieldset><legend id="gauge_legend"></legend>
    <div id="gauge_fields"></div>
    <button id="gauge_remove" type="button">Remove</button>
  </fieldset></form>`, { order: 7 });
at("gauges").hidden = true;
drawing.said = (words) => say("gauge_words", words);
drawing.added = () => { at("gauge_new_name").value = ""; drawing.name = ""; build(); };
const said = (reply) => drawing.said(reply.refused || "");

// ---- adding
const named = () => { drawing.name = at("gauge_new_name").value; };
on("gauge_new_name", "input", named);
on("gauge_draw", "click", () => {
  if (drawing.kind) stopDrawing();
  else beginDrawing(at("gauge_kind").value);
});
on("gauge_kind", "change", stopDrawing);
on("gauge_add", "submit", (event) => { event.preventDefault(); stopDrawing(); named(); add(usual(at("gauge_kind").value)); });

// ---- the list: one button a gauge, whose arrow keys move it
let listed = "";
function list() {
  const state = told(), all = tables(), readings = state.readings, names = JSON.stringify(all.map((table) => table.name));
  if (names !== listed) {
    listed = names;
    const had = document.activeElement && document.activeElement.dataset.gauge;
    at("gauge_list").replaceChildren(...all.map((table) => {
      const line = document.createElement("li"), button = document.createElement("button"), words = document.createElement("span");
      button.type = "button";
      button.textContent = table.name;
      button.dataset.gauge = table.name;
      button.title = "Arrow keys move it by 1 px, with Shift by 10";
      button.addEventListener("click", () => choose(table.name));
      button.addEventListener("keydown", nudge);
      words.className = "quiet";
      line.append(button, " ", words);
      if (had === table.name) requestAnimationFrame(() => button.focus());
      return line;
    }));
  }
  [...at("gauge_list").children].forEach((line, i) => {
    const [button, words] = line.children, reading = readings && readings[i];
    button.setAttribute("aria-pressed", String(all[i].name === board.chosen));
    const text = reading ? sentence(reading) : state.trouble ? "" : state.is_live ? "not read in this frame" : `followed to frame ${Math.max(0, state.frames - 1)}`;
    if (words.textContent !== text) words.textContent = text;
    words.className = reading ? (reading.status === "ok" ? "good" : "bad") : "quiet";
  });
}
function sentence(reading) {
  if (reading.status !== "ok") return `${reading.status}${reading.words ? `: ${reading.words}` : ""}`;
  return `${reading.cells.map(([quantity, value, u, unit]) => `${quantity} ${value.toFixed(4)} ${unit}, u ${u.toPrecision(2)} ${unit}`).join("; ")}; ok`;
}
function choose(name) {
  board.chosen = name;
  build();
  draw();
}
function nudge(event) {
  const move = MOVES[event.key], name = event.currentTarget.dataset.gauge;
  if (!move || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  event.stopPropagation();
  board.chosen = name;
  const [key, by] = move;
  change(name, { [key]: Number((chosen()[key] + by * (event.shiftKey ? MANY_PX : 1)).toFixed(3)) }, drawing.said);
  draw();
}

// ---- the fields of the chosen gauge: one a key of its kind
let built = "";
const refusedIn = new Set();
const idOf = (key) => `gauge_key_${key}`;
function build() {
  const table = chosen();
  at("gauge_form").hidden = !table || !board.kinds;
  if (!table || !board.kinds) { built = ""; return; }
  const which = `${table.kind} ${table.name}`;
  if (which !== built) {
    built = which;
    refusedIn.clear();
    at("gauge_legend").textContent = `${table.kind}: ${table.name}`;
    at("gauge_fields").replaceChildren(...[{ key: "name", choices: [], isText: true }, ...board.kinds[table.kind]].map((field) => one(field)));
  }
  fill(table);
}
function one(field) {
  const place = document.createElement("div"), label = document.createElement("label"), words = document.createElement("p");
  const input = document.createElement(field.choices.length ? "select" : "input");
  input.id = idOf(field.key);
  label.append(`${field.key} `, input);
  words.className = "refused";
  words.id = `${input.id}_why`;
  words.setAttribute("role", "status");
  input.setAttribute("aria-describedby", words.id);
  if (field.choices.length) for (const choice of field.choices) input.add(new Option(choice));
  else if (field.isText) { input.maxLength = 100; input.autocomplete = "off"; } else {
    input.inputMode = "decimal";
    input.autocomplete = "off";
    if (field.default !== null) input.placeholder = String(field.default);
  }
  input.addEventListener("change", () => typed(field, input));
  place.className = field.isText ? "wide" : "";
  place.append(label, words);
  return place;
}
function typed(field, input) {
  const name = board.chosen;
  let value = input.value;
  if (!field.choices.length && !field.isText) {
    value = number(value);
    if (typeof value === "string") { // not drawn before the server has read it
      refusedIn.add(field.key);
      request({ do: "gauge_change", name, changes: { [field.key]: value } }, (reply) => refused(reply.refused || "", reply.field, field.key));
      return;
    }
  }
  if (field.choices.length && value === field.default && !(field.key in chosen())) return;
  refusedIn.add(field.key); // until the answer comes, what was typed stays
  change(name, { [field.key]: value }, (words, key) => refused(words, key, field.key));
}
// The sentence stands beside the field that it is about; what was typed stays there.
function refused(words, key, asked) {
  const about = words && key && at(idOf(key)) ? key : asked, input = at(idOf(about));
  if (!input) { drawing.said(words); return; }
  at(`${input.id}_why`).textContent = words;
  input.setAttribute("aria-invalid", String(Boolean(words)));
  if (words) refusedIn.add(about); else refusedIn.delete(about);
}
function fill(table) {
  for (const { key, default: usually, choices } of [{ key: "name", choices: [] }, ...board.kinds[table.kind]]) {
    const input = at(idOf(key)), value = key in table ? table[key] : choices.length ? usually : "";
    input.disabled = !works();
    if (document.activeElement !== input && !refusedIn.has(key) && input.value !== String(value)) input.value = String(value);
  }
}

// ---- the file
on("gauge_remove", "click", () => { if (chosen()) request({ do: "gauge_remove", name: board.chosen }, said); });
on("gauge_first", "click", () => ask({ do: "seek", frame: told().first }));
on("gauge_save", "click", () => request({ do: "gauges_save" }, said));
on("gauge_over", "click", () => request({ do: "gauges_save", over: true }, said));
on("gauge_load", "click", () => {
  if (told().is_saved || confirm("Load the file? What is not saved is lost.")) request({ do: "gauges_load" }, (reply) => { board.local = null; built = ""; said(reply); });
});

// ---- the panel
let begun = false;
function open() {
  if (at("gauges").open && told() && !told().is_open && works()) request({ do: "gauges_open" }, said);
  draw();
}
at("gauges").addEventListener("toggle", open);
onChosen(build);
listen("state", (state) => {
  at("gauges").hidden = !state.gauges;
  if (!state.gauges) return;
  if (board.kinds && !at("gauge_kind").options.length) for (const kind of Object.keys(board.kinds)) at("gauge_kind").add(new Option(kind));
  if (!begun && state.gauges.is_asked_for) { at("gauges").open = true; begun = true; }
  if (!state.gauges.is_open) return;
  const now = state.gauges;
  say("gauge_file", now.file);
  say("gauge_saved", now.is_saved ? (now.tables.length ? "saved" : "") : "not saved");
  at("gauge_over").hidden = !now.changed_meanwhile;
  at("gauge_first").hidden = !told() || isFirst();
  const hint = now.tables.length === 0 ? `Choose a kind and draw it in the ${now.is_live ? "picture" : "first frame"}, or add it and type its numbers.` : now.is_live ? "What is changed is looked for where it is drawn, and followed from there." : isFirst() ? "" : "Numbers and drags place a gauge in the first frame; here it is shown where it was found.";
  say("gauge_hint", now.trouble || hint);
  for (const id of ["gauge_draw", "gauge_add_here", "gauge_remove", "gauge_save", "gauge_over", "gauge_load", "gauge_kind", "gauge_new_name"]) at(id).disabled = !works();
  list();
  build();
});
listen("state", () => { if (page.paused) draw(); });
// What is old looks old: no number, and no green.
listen("gone", () => {
  if (!told() || !told().is_open) return;
  told().readings = null;
  told().trouble = "Not connected: the gauges are not read.";
  list();
  draw();
});
