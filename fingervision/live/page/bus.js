// What the scripts of the page share: the newest state, who listens to what, and one way to ask the server.
export const at = (id) => document.getElementById(id);
export const token = new URLSearchParams(location.search).get("token") || "";

// `state` is the server's newest word, `now` the newest row in figures, `overlay` what was found in the picture shown.
export const page = { state: null, now: null, overlay: null, paused: false };

const listeners = new Map();
export function listen(kind, act) {
  if (!listeners.has(kind)) listeners.set(kind, []);
  listeners.get(kind).push(act);
}
// One listener's fault must not keep the others from what they wait for.
export function tell(kind, ...what) {
  for (const act of listeners.get(kind) || []) {
    try { act(...what); } catch (error) { console.error(error); }
  }
}

let send = null;
export function sendBy(way) { send = way; }
export function ask(request) {
  if (!send || !send(request)) tell("message", "The live view does not answer: nothing was asked.", "refused");
}

// ---- elements
export function say(id, words, kind) {
  if (at(id).textContent !== words) at(id).textContent = words;
  if (kind !== undefined && at(id).className !== kind) at(id).className = kind;
}
export const on = (id, what, act) => at(id).addEventListener(what, act);
// What is no plain number is left to the server, which reads a decimal comma, and asks where it may mean two numbers. A
// field of type number would drop the comma: 34,0 would be 340.
const PLAIN = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
export function typed(text) {
  const word = text.trim();
  return word === "" ? null : PLAIN.test(word) ? Number(word) : word;
}
export const number = (id) => typed(at(id).value);
document.addEventListener("keydown", (event) => {
  const input = event.target, sign = { ArrowUp: 1, ArrowDown: -1 }[event.key];
  if (!sign || input.inputMode !== "decimal") return;
  const value = typed(input.value);
  if (typeof value !== "number") return;
  event.preventDefault();
  input.value = String(Number((value + sign * Number(input.dataset.step || 1)).toFixed(6)));
  input.dispatchEvent(new Event("change"));
});
// A refusal or a question is shown beside the form that asked. What was refused stays to be mended while its form is in
// focus; when that is left, `restore` puts the values in force back, and the message goes with what it was about.
const askedBy = new Map();
export function beside(form, restore = () => {}) {
  const words = document.createElement("p");
  words.className = "refused";
  words.setAttribute("role", "status");
  form.after(words);
  form.addEventListener("focusout", (event) => {
    if (form.contains(event.relatedTarget) || !words.textContent || words.querySelector("button")) return;
    words.textContent = "";
    restore();
  });
  return (request) => { words.textContent = ""; askedBy.set(request.do, words); ask(request); };
}
export function submit(id, act, restore) {
  const form = at(id), asks = beside(form, restore);
  form.noValidate = true; // the server says in a sentence what is missing
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const request = act(event.submitter || form);
    if (request) asks(request);
  });
}
// Fields that show the values in force; what is typed stays until those change.
export function inForce(fields) {
  let known = "", restored = {};
  const restore = () => { for (const [id, value] of Object.entries(restored)) at(id).value = value; };
  listen("state", (state) => {
    restored = Object.fromEntries(Object.entries(fields).map(([id, of]) => [id, of(state) ?? ""]));
    const now = JSON.stringify(restored);
    if (now !== known) { known = now; restore(); }
  });
  return restore;
}
listen("reply", (reply) => {
  const words = askedBy.get(reply.do);
  if (words) words.textContent = reply.refused || reply.question || "";
  if (!words || !reply.question) return;
  const yes = document.createElement("button");
  yes.type = "button";
  yes.className = "sure";
  yes.textContent = "Yes, use it";
  yes.addEventListener("click", () => { words.textContent = ""; ask(reply.request); });
  words.append(" ", yes);
});

// A panel beside the bench; what is in it is the panel's own.
export function panel(id, title, content, { open = false, order = 50 } = {}) {
  const details = document.createElement("details"), summary = document.createElement("summary");
  details.id = id;
  details.open = open;
  details.dataset.order = String(order);
  summary.innerHTML = title;
  details.innerHTML = content;
  details.prepend(summary);
  const before = [...at("panels").children].find((other) => Number(other.dataset.order) > order);
  at("panels").insertBefore(details, before || null);
  return details;
}
export function download(address, name) {
  const link = document.createElement("a");
  link.href = address; link.download = name; link.click();
}
export const withToken = (path) => `${path}${path.includes("?") ? "&" : "?"}token=${encodeURIComponent(token)}`;
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
export const calm = matchMedia("(prefers-reduced-motion: reduce)");
