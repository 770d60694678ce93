// One socket, one acknowledgement a message: the server sends the newest, and nothing queues.
import { page, listen, say, sendBy, tell, token } from "/page/bus.js";
import { draw } from "/page/picture_view.js";

const AGAIN_AFTER_MS = 500, SILENT_MS = 1000, UNSEEN_EVERY_MS = 1000;
let socket = null, lastAt = 0, view = "", rows = 0, said = 0, goneAt = 0, fresh = true, busy = false;

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const known = view ? `&view=${encodeURIComponent(view)}&rows=${rows}&messages=${said}` : "";
  socket = new WebSocket(`${scheme}://${location.host}/socket?token=${encodeURIComponent(token)}${known}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { fresh = true; say("connection", "connected", ""); };
  socket.onclose = (event) => {
    if (!goneAt) goneAt = performance.now();
    // A server that refuses says why: too many pages, or too many messages.
    say("connection", event.reason || "The live view does not answer: trying again.", "bad");
    tell("gone", event.reason ||
      "The live view is not running, or out of reach. This page goes on by itself when it is back.");
    setTimeout(connect, AGAIN_AFTER_MS);
  };
  socket.onmessage = (event) => {
    if (typeof event.data === "string") answer(JSON.parse(event.data));
    else take(event.data);
  };
}
sendBy((request) => {
  if (!socket || socket.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify(request));
  return true;
});

// What this page missed while it was away, and whether it is in the chart now.
function cameBack(head) {
  if (!goneAt) return;
  const away_s = ((performance.now() - goneAt) / 1000).toFixed(1);
  goneAt = 0;
  if (head.view !== view) { tell("message", `Away for ${away_s} s: the live view was started anew meanwhile.`, "away"); return; }
  const missed = head.count - rows, lost = head.first - rows;
  const chart = lost > 0 ? `; the chart has all but the oldest ${lost}, which are no longer kept` : ", all of them in the chart";
  tell("message", `Away for ${away_s} s: ${missed} frames came meanwhile${missed ? chart : ""}.`, "away");
}

async function take(buffer) {
  const length = new DataView(buffer).getUint32(0);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  lastAt = performance.now();
  page.state = head.state;
  page.now = head.now;
  if (fresh) {
    fresh = false;
    cameBack(head);
  }
  if (head.view !== view) { // after a restart, or with other settings, the server counts anew
    view = head.view;
    said = 0;
    tell("cleared");
  }
  rows = head.last;
  tell("points", head.points);
  tell("gauge_points", head.gauge_points);
  for (const [name_number, name, words] of head.messages) { said = name_number; tell("message", words, name); }
  tell("state", head.state);
  if (!page.paused) {
    // The value is that of the picture beside it, or of a newer frame where only now and then one is sent.
    busy = true;
    if (buffer.byteLength > 4 + length) await draw(new Uint8Array(buffer, 4 + length), head.overlay);
    busy = false;
    if (!page.paused) tell("now", head.now);
  }
  if (document.hidden) { // nobody sees what would come: once a second will do
    busy = true;
    await new Promise((go) => { document.addEventListener("visibilitychange", go, { once: true }); setTimeout(go, UNSEEN_EVERY_MS); });
    busy = false;
  }
  lastAt = performance.now();
  if (socket.readyState === WebSocket.OPEN) socket.send('{"do":"ack"}');
}

function answer(reply) {
  if (reply.refused || reply.question) tell("message", reply.refused || reply.question, "refused");
  else if (reply.words) tell("message", reply.words, reply.do);
  tell("reply", reply);
}

setInterval(() => {
  if (busy) return; // it is this browser that is slow, and the server waits for it
  if (!lastAt || !socket || socket.readyState !== WebSocket.OPEN) return;
  if (performance.now() - lastAt > SILENT_MS) {
    say("connection", "The live view does not answer.", "bad");
    tell("gone", "The live view does not answer.");
  } else say("connection", "connected", "");
}, 250);
listen("start", connect);
