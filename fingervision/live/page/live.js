// The live page: one socket, one acknowledgement a message, one picture, one chart. Nothing else is loaded or sent.
"use strict";
(() => {
  const token = new URLSearchParams(location.search).get("token") || "";
  const at = (id) => document.getElementById(id);
  const canvas = at("picture"), pen = canvas.getContext("2d"), stage = at("stage");
  // Ten minutes at 25 frames a second; the chart then forgets its beginning.
  const MOST_POINTS = 15000, AGAIN_AFTER_MS = 500, SILENT_MS = 1000, WINDOW_S = 30, CHART_PX = 180;
  let socket = null, paused = false, lastAt = 0, state = null, drag = null, dragFor = null, reference = null;
  let data = [[], [], [], []], zoomed = false, dirty = false, chart = null, firstMessage = true;

  // ---- the socket
  function connect() {
    socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(token)}`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { firstMessage = true; say("connection", "connected", ""); };
    socket.onclose = () => {
      say("connection", "The live view does not answer: trying again.", "bad");
      stale("not connected");
      alarm("The live view is not running, or out of reach. This page goes on by itself when it is back.");
      setTimeout(connect, AGAIN_AFTER_MS);
    };
    socket.onmessage = (event) => {
      if (typeof event.data === "string") answer(JSON.parse(event.data));
      else take(event.data);
    };
  }
  const ask = (request) => {
    if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(request));
    else log("The live view does not answer: nothing was asked.");
  };

  async function take(buffer) {
    const length = new DataView(buffer).getUint32(0);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    lastAt = performance.now();
    state = head.state;
    if (firstMessage) { // after a restart the server counts anew
      firstMessage = false;
      data = [[], [], [], []];
    }
    points(head.points);
    for (const [, name, words] of head.messages) log(words, name);
    facts(head.state);
    if (!paused) {
      figures(head.now);
      if (buffer.byteLength > 4 + length) {
        try {
          const picture = await createImageBitmap(new Blob([new Uint8Array(buffer, 4 + length)], { type: "image/jpeg" }));
          if (canvas.width !== picture.width) canvas.width = picture.width;
          if (canvas.height !== picture.height) canvas.height = picture.height;
          pen.drawImage(picture, 0, 0);
          picture.close();
          canvas.dataset.shown = String(Number(canvas.dataset.shown || 0) + 1);
        } catch { log("A picture could not be shown."); }
      }
    }
    if (socket.readyState === WebSocket.OPEN) socket.send('{"do":"ack"}');
  }

  function answer(reply) {
    if (reply.refused) { log(reply.refused, "refused"); alarmFor(reply.refused); return; }
    if (reply.words) log(reply.words, reply.do);
    if (reply.steps && reply.steps.length) showSteps(reply.steps);
  }

  // ---- words
  function say(id, words, kind) { at(id).textContent = words; at(id).className = kind; }
  function log(words, name) {
    const line = document.createElement("li");
    line.textContent = `${new Date().toLocaleTimeString()}  ${words}`;
    line.dataset.name = name || "";
    at("log").prepend(line);
    while (at("log").children.length > 100) at("log").lastChild.remove();
  }
  function alarm(words) { at("alarm").hidden = !words; at("alarm").textContent = words; }
  let alarmUntil = 0;
  function alarmFor(words) { alarm(words); alarmUntil = performance.now() + 6000; }

  function facts(now) {
    at("source").textContent = now.source;
    at("rate").textContent = now.rate_hz === null ? "–" : now.rate_hz.toFixed(2);
    at("jitter").textContent = now.jitter_ms === null ? "–" : now.jitter_ms.toFixed(2);
    for (const id of ["dropped", "duplicates", "damaged"]) at(id).textContent = now[id];
    at("frame_size").textContent = `${now.width_px}×${now.height_px}`;
    at("camera").hidden = !now.camera;
    at("camera").textContent = `Camera: ${now.camera}`;
    at("exposure").hidden = !now.exposure;
    at("exposure").textContent = now.exposure;
    const recording = now.recording !== null;
    at("record").setAttribute("aria-pressed", String(recording));
    at("record").textContent = recording ? "Stop" : "Record";
    at("recording").hidden = !recording;
    if (recording) at("recording").textContent = `Recording: ${now.recording.frames} frames in ${now.recording.path}`;
    const u = now.u_px_per_mm === null ? " (no uncertainty)" : ` ± ${(2 * now.u_px_per_mm).toFixed(4)}`;
    at("scale").textContent = now.px_per_mm === null ? "not known" : `${now.px_per_mm.toFixed(4)}${u} px/mm`;
    if (document.activeElement !== at("tips")) at("tips").value = now.tips;
    if (document.activeElement !== at("below_tip")) at("below_tip").value = now.below_tip_mm;
    const whole = now.region || [0, 0, now.width_px, now.height_px];
    if (!at("region_form").contains(document.activeElement))
      ["region_x", "region_y", "region_w", "region_h"].forEach((id, i) => { at(id).value = whole[i]; });
    if (!drag) showBox(reference || now.region);
    if (performance.now() < alarmUntil) return;
    if (now.trouble) alarm(now.trouble);
    else if (now.ended) alarm("The source has ended.");
    else if (now.silent_s > 0) alarm(`No picture for ${now.silent_s.toFixed(1)} s: the source is silent or cut off. Measuring resumes by itself.`);
    else if (now.px_per_mm === null) alarm("The scale is not known, so nothing is measured: drag over a reference and give its size, or type the scale.");
    else alarm("");
  }

  function figures(now) {
    const gap = at("gap_mm");
    // What is old looks old: no value, and no green.
    if (state && (state.silent_s > 0 || state.ended)) { stale(state.ended ? "ended" : "no picture"); return; }
    if (!now || now.gap_mm === null) {
      gap.textContent = "–";
      at("uncertainty").textContent = "\u00a0";
    } else {
      gap.textContent = (now.gap_mm - now.zero_mm).toFixed(4);
      const what = now.has_budget ? "k = 2" : "k = 2, from frame to frame; the scale has no uncertainty";
      at("zeroed").hidden = now.zero_mm === 0;
      at("zeroed").textContent = `less zero ${now.zero_mm.toFixed(4)} mm`;
      at("uncertainty").textContent = now.u_mm === null ? "" : `± ${(2000 * now.u_mm).toFixed(2)} µm (${what})`;
    }
    gap.dataset.frame = now ? String(now.frame) : "";
    say("status", now ? now.status : "–", `badge ${now && now.status === "ok" ? "good" : "bad"}`);
    at("why").textContent = now ? now.words : "";
    at("unzero").hidden = !now || now.zero_mm === 0;
    if (now) at("unzero").textContent = `Zero off (${now.zero_mm.toFixed(4)} mm)`;
    const verdict = now ? now.verdict : "";
    at("verdict").hidden = !verdict;
    say("verdict", verdict, `badge ${{ pass: "good", fail: "bad", unsure: "unsure" }[verdict] || ""}`);
  }

  function stale(words) {
    at("gap_mm").textContent = "–";
    at("uncertainty").textContent = "\u00a0";
    at("zeroed").hidden = true;
    say("status", words, "badge bad");
    at("why").textContent = "";
    at("verdict").hidden = true;
  }

  // ---- the chart
  function points(fresh) {
    for (const [time, gap, u] of fresh) {
      data[0].push(time); data[1].push(gap);
      data[2].push(gap === null ? null : gap - 2 * u); data[3].push(gap === null ? null : gap + 2 * u);
    }
    // Where frames are missing no line is drawn.
    const hole_s = state.rate_hz ? Math.max(0.15, 4 / state.rate_hz) : 0.25;
    const from = Math.max(1, data[0].length - fresh.length);
    for (let i = data[0].length - 1; i >= from; i -= 1) {
      if (data[0][i] - data[0][i - 1] > hole_s) {
        data[0].splice(i, 0, (data[0][i] + data[0][i - 1]) / 2);
        for (const column of [1, 2, 3]) data[column].splice(i, 0, null);
      }
    }
    if (data[0].length > MOST_POINTS) data = data.map((column) => column.slice(-MOST_POINTS));
    dirty = dirty || fresh.length > 0;
  }
  function colour(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
  function chartWidth() { return at("chart").clientWidth || 600; }
  function makeChart() {
    if (chart) chart.destroy();
    const ink = colour("--ink"), line = colour("--line"), accent = colour("--accent");
    const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 } };
    chart = new uPlot({
      width: chartWidth(), height: CHART_PX,
      cursor: { drag: { x: true, y: false } },
      scales: { x: { time: false } },
      axes: [{ ...axis, label: "time (s)" }, { ...axis, label: "gap (mm)", size: 70 }],
      series: [
        { label: "time (s)", value: (_, v) => (v === null ? "–" : v.toFixed(3)) },
        { label: "gap (mm)", stroke: accent, width: 1.5, value: (_, v) => (v === null ? "–" : v.toFixed(4)) },
        { label: "− U", stroke: "transparent", points: { show: false }, value: (_, v) => (v === null ? "–" : v.toFixed(4)) },
        { label: "+ U", stroke: "transparent", points: { show: false }, value: (_, v) => (v === null ? "–" : v.toFixed(4)) },
      ],
      bands: [{ series: [3, 2], fill: accent + "44" }],
      hooks: { setSelect: [(u) => { if (u.select.width > 2) zoomed = true; }] },
    }, data, at("chart"));
    at("chart").addEventListener("dblclick", all);
  }
  function follow() { zoomed = false; dirty = true; }
  function all() { // from the beginning on, as far as it is kept
    zoomed = true;
    dirty = true;
    if (data[0].length > 1) chart.setScale("x", { min: data[0][0], max: data[0][data[0].length - 1] });
  }
  function drawChart() {
    if (dirty && chart && !paused && !document.hidden) {
      dirty = false;
      const zero = state ? state.zero_mm : 0, count = data[0].length;
      // New points come in without moving what is looked at; else the last half minute moves along.
      let { min, max } = chart.scales.x;
      if (!zoomed && count > 1) { max = data[0][count - 1]; min = Math.max(data[0][0], max - WINDOW_S); }
      let shown = data;
      if (!zoomed) {
        const from = data[0].findIndex((time) => time >= min);
        shown = data.map((column) => column.slice(Math.max(0, from - 1)));
      }
      if (zero !== 0) shown = shown.map((column, i) => (i === 0 ? column : column.map((v) => (v === null ? null : v - zero))));
      chart.batch(() => { chart.setData(shown, count < 2); if (count > 1) chart.setScale("x", { min, max }); });
    }
  }
  function savePlot() {
    const drawn = chart.root.querySelector("canvas"), sheet = document.createElement("canvas");
    sheet.width = drawn.width; sheet.height = drawn.height;
    const ink = sheet.getContext("2d");
    ink.fillStyle = colour("--card"); ink.fillRect(0, 0, sheet.width, sheet.height); ink.drawImage(drawn, 0, 0);
    sheet.toBlob((blob) => download(URL.createObjectURL(blob), "gap.png"));
  }
  function download(address, name) {
    const link = document.createElement("a");
    link.href = address; link.download = name; link.click();
  }

  // ---- the steps
  function showSteps(names) {
    const place = at("step_pictures"), version = Date.now();
    place.replaceChildren(...names.map((name, number) => {
      const figure = document.createElement("figure"), picture = document.createElement("img"), words = document.createElement("figcaption");
      picture.src = `/steps/${number}.png?token=${encodeURIComponent(token)}&version=${version}`;
      picture.alt = words.textContent = name;
      figure.append(picture, words);
      return figure;
    }));
    place.hidden = false;
    place.scrollIntoView({ block: "nearest" });
  }

  // ---- dragging
  function startDrag(what, words) {
    dragFor = dragFor === what ? null : what;
    stage.classList.toggle("dragging", dragFor !== null);
    at("drag_region").setAttribute("aria-pressed", String(dragFor === "region"));
    at("drag_reference").setAttribute("aria-pressed", String(dragFor === "reference"));
    at("hint").textContent = dragFor ? words : "";
  }
  function inPicture(event) {
    const frame = canvas.getBoundingClientRect();
    const x = ((event.clientX - frame.left) / frame.width) * canvas.width, y = ((event.clientY - frame.top) / frame.height) * canvas.height;
    return [Math.min(canvas.width, Math.max(0, x)), Math.min(canvas.height, Math.max(0, y))];
  }
  function boxOf([x0, y0], [x1, y1]) {
    const x = Math.round(Math.min(x0, x1)), y = Math.round(Math.min(y0, y1));
    return [x, y, Math.round(Math.max(x0, x1)) - x, Math.round(Math.max(y0, y1)) - y];
  }
  function showBox(box) {
    at("box").hidden = !box;
    if (!box) return;
    const share = (value, of) => `${(100 * value) / of}%`, style = at("box").style;
    style.left = share(box[0], canvas.width); style.top = share(box[1], canvas.height);
    style.width = share(box[2], canvas.width); style.height = share(box[3], canvas.height);
  }
  canvas.addEventListener("pointerdown", (event) => {
    if (!dragFor) return;
    drag = inPicture(event);
    canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  canvas.addEventListener("pointermove", (event) => { if (drag) showBox(boxOf(drag, inPicture(event))); });
  canvas.addEventListener("pointerup", (event) => {
    if (!drag) return;
    const box = boxOf(drag, inPicture(event)), what = dragFor;
    drag = null;
    startDrag(what, "");
    if (box[2] < 8 || box[3] < 8) { log("Drag over at least 8 pixels each way."); return; }
    if (what === "region") ask({ do: "region", box });
    else { reference = box; at("hint").textContent = "Give the reference's size and press Calibrate."; at("size_mm").focus(); }
  });
  canvas.addEventListener("pointercancel", () => { drag = null; });

  // ---- controls
  const on = (id, what, act) => at(id).addEventListener(what, act);
  const number = (id) => (at(id).value === "" ? null : Number(at(id).value));
  const submit = (id, act) => on(id, "submit", (event) => { event.preventDefault(); act(); });
  on("pause", "click", () => {
    paused = !paused;
    at("pause").setAttribute("aria-pressed", String(paused));
    at("pause").textContent = paused ? "Go on" : "Pause";
    at("hint").textContent = paused ? "The view is paused; measuring goes on." : "";
    dirty = true;
  });
  on("record", "click", () => ask({ do: state && state.recording ? "stop" : "record" }));
  on("snapshot", "click", () => ask({ do: "snapshot" }));
  on("zero", "click", () => ask({ do: "zero" }));
  on("unzero", "click", () => ask({ do: "zero", off: true }));
  on("steps", "click", () => ask({ do: "steps" }));
  on("save_csv", "click", () => download(`/gaps.csv?token=${encodeURIComponent(token)}`, "gaps.csv"));
  on("save_plot", "click", savePlot);
  on("follow", "click", follow);
  on("drag_region", "click", () => startDrag("region", "Drag over the part of the picture to look at."));
  on("drag_reference", "click", () => startDrag("reference", "Drag over the reference, with some ground around it."));
  on("whole", "click", () => { reference = null; ask({ do: "region", box: null }); });
  on("tips", "change", () => ask({ do: "tips", tips: at("tips").value }));
  on("below_tip", "change", () => ask({ do: "height", below_tip_mm: number("below_tip") }));
  submit("region_form", () => ask({ do: "region", box: ["region_x", "region_y", "region_w", "region_h"].map(number) }));
  submit("limits_form", () => ask({ do: "limits", least: number("least"), greatest: number("greatest") }));
  submit("scale_form", () => ask({ do: "scale", px_per_mm: number("px_per_mm") }));
  submit("calibrate_form", () => {
    const box = reference || (state && [0, 0, state.width_px, state.height_px]);
    ask({ do: "calibrate", box, kind: at("kind").value, size_mm: number("size_mm"), u_size_mm: number("u_size_mm") });
    reference = null;
    at("hint").textContent = "";
  });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && document.activeElement) document.activeElement.blur(); // back to the single keys
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    const press = { p: "pause", r: "record", s: "snapshot", z: "zero", i: "steps", f: "follow" }[event.key];
    if (press) at(press).click();
    if (event.key === "Escape") { drag = null; reference = null; dragFor = null; stage.classList.remove("dragging"); at("hint").textContent = ""; }
  });
  window.addEventListener("resize", () => { if (chart) chart.setSize({ width: chartWidth(), height: CHART_PX }); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", makeChart);
  setInterval(() => {
    if (lastAt && performance.now() - lastAt > SILENT_MS && socket.readyState === WebSocket.OPEN) {
      alarm("The live view does not answer.");
      say("connection", "The live view does not answer.", "bad");
      stale("not connected");
    } else if (lastAt && socket.readyState === WebSocket.OPEN) say("connection", "connected", "");
  }, 250);
  makeChart();
  setInterval(drawChart, 100);
  connect();
})();
