// The gauges as this page has them: the server's, with what is being dragged here before the server has answered.
import { ask, listen, page } from "/page/bus.js";

export const board = { kinds: null, chosen: null, renamed: null, local: null };
export const told = () => (page.state && page.state.gauges) || null;
export const works = () => page.state && !page.state.viewer && page.state.holds_pen !== false;
export function tables() {
  const state = told(), { local } = board;
  if (!state || !state.is_open) return [];
  return state.tables.map((table) => {
    if (!local || local.name !== table.name) return table;
    return Object.fromEntries(Object.entries({ ...table, ...local.changes }).filter(([, value]) => value !== null));
  });
}
export const chosen = () => tables().find((table) => table.name === board.chosen) || null;
// On a camera's picture every frame is one to draw in.
export const isFirst = () => told() && (told().is_live || told().frame === told().first);

// Answers come in the order of the requests.
let asked = [];
export function request(what, answered = () => {}) {
  asked.push(answered);
  ask(what);
}
const OURS = /^gauge/;
listen("reply", (reply) => {
  if (!OURS.test(reply.do || "")) return;
  const answered = asked.shift();
  if (answered) answered(reply);
});
listen("gone", () => { asked = []; board.local = null; });

// Show other values of a gauge before the server has them.
export function show(name, changes) {
  const { local } = board, is = local && local.name === name;
  board.local = { name, changes: { ...(is ? local.changes : {}), ...changes }, pending: is ? local.pending : 0, version: null };
}
// Give a gauge other values (null takes a key away); `answered(words, key)` is told of a refusal, or that there is none.
export function change(name, changes, answered) {
  // The state may bring the new name before the answer does: the gauge stays the chosen one.
  if ("name" in changes && board.chosen === name) board.renamed = changes.name;
  if (!("name" in changes)) { show(name, changes); board.local.pending += 1; }
  request({ do: "gauge_change", name, changes }, (reply) => {
    const { local } = board;
    if (local && local.name === name && !("name" in changes)) local.pending -= 1;
    if (board.renamed === changes.name) board.renamed = null;
    if (reply.refused) { board.local = null; answered(reply.refused, reply.field); return; }
    // The server's word is in the next state; what was asked since then stays until its own answer.
    if (local && local.pending === 0) local.version = reply.version;
    if ("name" in changes && board.chosen === name) board.chosen = changes.name;
    answered("", null);
  });
}
// What a new gauge of a kind begins with: its required keys, in the picture's middle.
export function usual(kind) {
  const fields = board.kinds[kind], table = { name: freeName(kind), kind };
  for (const field of fields) if (field.default === null) table[field.key] = field.usual;
  table.x_px = Math.round((page.state.width_px - 1) / 2);
  table.y_px = Math.round((page.state.height_px - 1) / 2);
  if ("direction_deg" in table) table.direction_deg = 0;
  if ("angle_deg" in table) table.angle_deg = 0;
  return table;
}
export function freeName(word) {
  const taken = new Set(tables().map((table) => table.name));
  if (!taken.has(word)) return word;
  let number = 2;
  while (taken.has(`${word} ${number}`)) number += 1;
  return `${word} ${number}`;
}
listen("state", (state) => {
  if (state.gauges && !board.kinds && !asked.length) request({ do: "gauge_kinds" }, (reply) => { board.kinds = reply.kinds || null; });
  const { local } = board;
  if (local && local.version !== null && state.gauges && state.gauges.version >= local.version) board.local = null;
  const has = (name) => tables().some((table) => table.name === name);
  if (state.gauges && state.gauges.is_open && !has(board.chosen)) board.chosen = has(board.renamed) ? board.renamed : tables().length ? tables()[0].name : null;
});
