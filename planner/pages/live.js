
// A stance that a person moves: handles over the scene, and the plan of where they are ------------

const live = data.live, token = new URLSearchParams(location.search).get("token") ?? "";
const past = []; // moves to go back to
let moves = { body: [0, 0, 0], hands: {} }, wanted = null, busy = false, resting, planned = 0, slips = null;

async function ask(path, question) {
  try {
    const headers = { "Content-Type": "application/json", "X-Crux-Token": token };
    const reply = await fetch(path, { method: "POST", headers, body: JSON.stringify(question) });
    return reply.ok ? await reply.json() : { error: (await reply.text()).trim() };
  } catch { return { error: "crux view does not answer: it has ended; start it again", gone: true }; }
}

// where points are on the screen, as plotly's own texts find it
function pixelOf(point) {
  const { glplot, dataScale, container } = byId("scene")._fullLayout.scene._scene;
  let at = [...point.map((c, k) => c * dataScale[k]), 1];
  for (const name of ["model", "view", "projection"]) {
    const m = glplot.cameraParams[name];
    at = [0, 1, 2, 3].map((row) => m[row] * at[0] + m[4 + row] * at[1] + m[8 + row] * at[2] + m[12 + row] * at[3]);
  }
  return [0.5 * (1 + at[0] / at[3]) * container.clientWidth, 0.5 * (1 - at[1] / at[3]) * container.clientHeight];
}

function pixelsAlong(place, axis) { // on the screen, for a metre along an axis in W
  const [from, to] = [pixelOf(place), pixelOf(place.map((c, k) => c + 1e-3 * axis[k]))];
  return [0, 1].map((k) => 1e3 * (to[k] - from[k]));
}

function screenAxes() { // of W, to the right and upward
  const { eye, center, up } = byId("scene")._fullLayout.scene._scene.getCamera(), list = (v) => [v.x, v.y, v.z];
  const cross = (a, b) => [0, 1, 2].map((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
  const unit = (v) => v.map((c) => c / (Math.hypot(...v) || 1)), ahead = list(center).map((c, k) => c - list(eye)[k]);
  const right = unit(cross(ahead, list(up)));
  return [right, unit(cross(right, ahead))];
}

const isBody = (name) => name === "body";
const shiftOf = (all, name) => isBody(name) ? all.body : all.hands[name] ?? [0, 0];
function withShift(name, shift) {
  const rounded = shift.map((c) => Math.round(1e4 * c) / 1e4 + 0); // to a tenth of a millimetre
  return isBody(name) ? { ...moves, body: rounded } : { ...moves, hands: { ...moves.hands, [name]: rounded } };
}

function dragged(grip, dx, dy) { // the shift that takes a handle so many pixels on
  const [[ax, ay], [bx, by]] = grip.along, [n, m, o] = [ax * ax + ay * ay, ax * bx + ay * by, bx * bx + by * by];
  const [p, q] = [ax * dx + ay * dy, bx * dx + by * dy], least = 0.01 * (n + o); // an axis seen from its end hardly moves
  const size = (n + least) * (o + least) - m * m, parts = [((o + least) * p - m * q) / size, ((n + least) * q - m * p) / size];
  return grip.shift.map((c, k) => c + (isBody(grip.name) ? grip.axes[0][k] * parts[0] + grip.axes[1][k] * parts[1] : parts[k]));
}

function stepped(name, key, length) { // by an arrow key, along the axis that looks most like it
  const { place, axes } = live.handles[name], seen = axes.map((axis) => pixelsAlong(place, axis));
  const most = (part, but) => seen.reduce((best, v, n) => n !== but && (best < 0 || Math.abs(v[part]) > Math.abs(seen[best][part])) ? n : best, -1);
  const aside = most(0, -1), other = most(1, aside), sideways = key === "ArrowLeft" || key === "ArrowRight";
  const axis = sideways ? aside : other, wants = key === "ArrowRight" || key === "ArrowDown" ? 1 : -1;
  const sign = wants * (Math.sign(seen[axis][sideways ? 0 : 1]) || 1);
  return shiftOf(moves, name).map((c, n) => n === axis ? c + sign * length : c);
}

function say(text, wrong) {
  byId("said").textContent = text;
  byId("said").classList.toggle("wrong", Boolean(wrong));
}

function sayMoves() {
  const told = (name, shift, frame) => `${words(name)} [${shift.map((c) => fixed(1e3 * c, 1)).join(", ")}] mm ${frame}`;
  const hands = Object.entries(moves.hands).filter(([, shift]) => shift.some(Boolean));
  const all = [...(moves.body.some(Boolean) ? [told("body", moves.body, "in W")] : []), ...hands.map(([name, shift]) => told(name, shift, "along its rock"))];
  say(all.length ? `moved: ${all.join("; ")}` : "as given");
}

function change(next, brief = true) {
  moves = next;
  wanted = { moves, brief };
  byId("undo").disabled = !past.length;
  clearTimeout(resting);
  if (brief) resting = setTimeout(() => { wanted = { moves, brief: false }; follow(); }, 300);
  follow();
}

async function follow() { // one question at a time, the newest
  if (busy) return;
  busy = true;
  while (wanted) {
    const asked = wanted;
    wanted = null;
    const reply = await ask("/plan", asked);
    if (reply.error) say(reply.error, true);
    else { await take(reply.answer, asked.brief); sayMoves(); }
    document.body.classList.toggle("stale", Boolean(reply.error) || asked.brief);
    document.body.dataset.planned = ++planned; // questions whose answers are drawn
    if (!reply.error && !asked.brief && !wanted && data.stages[0].status !== "optimal") advise(asked.moves);
  }
  busy = false;
}

async function take({ stage, meshes, handles }, brief) {
  data.meshes.splice(live.kept, Infinity, ...meshes);
  for (const index of unpacked.keys()) if (index >= live.kept) unpacked.delete(index);
  live.handles = handles;
  drawnAdvice = null;
  data.stages[0] = brief ? { ...data.stages[0], advice: null, ...stage } : stage;
  if (!brief) { widen(); return show(); }
  showOutcome(stage);
  await drawScene();
}

function widen() { // the axes, where something has left them
  const now = bounds(0), wide = bounds(0.2), left = ranges.some(([low, high], k) => now[k][0] < low || now[k][1] > high);
  if (left) ranges = ranges.map(([low, high], k) => [Math.min(low, wide[k][0]), Math.max(high, wide[k][1])]);
}

async function advise(asked) {
  const reply = await ask("/advice", { moves: asked });
  if (asked !== moves || !reply.answer) return;
  data.stages[0].advice = reply.answer;
  showWords(data.stages[0]);
}

function handleOf(name) {
  const handle = made("button", "", "handle");
  handle.dataset.limb = name;
  handle.setAttribute("aria-label", `${words(name)}: drag, or arrow keys by 1 mm, with shift by 10 mm`);
  handle.title = words(name);
  let grip = null;
  handle.onpointerdown = (event) => {
    if (event.button) return;
    const { place, axes: own } = live.handles[name], axes = isBody(name) ? screenAxes() : own;
    grip = { name, axes, along: axes.map((axis) => pixelsAlong(place, axis)), shift: shiftOf(moves, name), before: moves, x: event.clientX, y: event.clientY };
    handle.setPointerCapture(event.pointerId);
  };
  handle.onpointermove = (event) => {
    if (!grip) return;
    const [dx, dy] = [event.clientX - grip.x, event.clientY - grip.y];
    if (!grip.moved && Math.hypot(dx, dy) < 3) return; // a click chooses alone
    if (!grip.moved) past.push(grip.before);
    grip.moved = true;
    change(withShift(name, dragged(grip, dx, dy)));
  };
  handle.onpointerup = handle.onpointercancel = () => { grip = null; };
  handle.onkeydown = (event) => {
    if (!event.key.startsWith("Arrow") || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    past.push(moves);
    change(withShift(name, stepped(name, event.key, event.shiftKey ? 0.01 : 0.001)));
  };
  return handle;
}

function placeHandles() { // where the camera sees them, at each frame
  requestAnimationFrame(placeHandles);
  if (document.body.dataset.shown === undefined) return;
  const arrows = data.stages[0].scene.arrows.filter((a) => a.kind === "force"); // of the hands, in their order
  for (const [n, handle] of [...byId("handles").children].entries()) {
    const [x, y] = pixelOf(live.handles[handle.dataset.limb].place), where = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    const used = isBody(handle.dataset.limb) ? "var(--ink)" : arrows[n] ? colourOf(arrows[n].used) : "var(--load)";
    if (handle.style.transform !== where) handle.style.transform = where;
    if (handle.style.getPropertyValue("--used") !== used) handle.style.setProperty("--used", used);
  }
}

function undo() {
  if (past.length) change(past.pop(), false);
}

function lostTiles(scene) { // a cross at each tile that a stream has lost
  const lost = (slips ?? []).flatMap((s) => scene.tiles.filter((t) => t.limb === s.limb && t.finger === s.finger && t.phalanx === s.phalanx));
  return [dotsOf(lost.map((t) => t.start), { text: lost.map((t) => `${plain(t.limb)}, ${plain(t.finger)}, ${plain(t.phalanx)}: slipped`),
    hovertemplate: "%{text}<extra></extra>", marker: { symbol: "x", size: 7, color: data.colours.overload } })];
}

async function followStreams() {
  let count = 0;
  for (;;) {
    const { answer, error } = await ask("/follow", { count });
    if (error) { byId("stream-words").textContent = error; await new Promise((go) => setTimeout(go, 2000)); continue; }
    count = answer.count;
    if (!answer.reply) { if (!count) byId("stream-words").textContent = "no service has published set-points yet"; continue; }
    const { stream, number, age, skipped, set_points: points, error: fault } = answer.reply;
    const head = `stream ${stream}, wrench ${number ?? "–"}, ${fixed(1e3 * age, 1)} ms after it came, ${skipped} skipped`;
    byId("stream-words").textContent = points ? `${points.status}, utilisation ${fixed(points.utilisation, 2)}: ${head}${points.reason ? `; ${points.reason}` : ""}` : `${fault.message}: ${head}`;
    slips = points?.lost ?? [];
    byId("stream-lost").textContent = slips.length ? `slipped: ${slips.map((s) => words(`${s.limb} ${s.finger} ${s.phalanx}`)).join("; ")}` : "";
    const rows = (points?.hands ?? []).flatMap((hand) => hand.tensions.map((tension, n) => [words(hand.limb), words(live.fingers[n]), tension]));
    drawTable({ title: "stream", columns: "limb,finger,tension [N]", rows }, byId("stream-table"));
    await drawScene();
    document.body.dataset.followed = count;
  }
}

function begin() {
  const around = made("div", "", "around"), handles = Object.assign(made("div"), { id: "handles" }), bar = made("div", "", "buttons");
  const button = (text, id, press) => bar.append(Object.assign(made("button", text), { id, onclick: press }));
  button("undo", "undo", undo);
  byId("views").before(bar);
  button("save as stance", "save", async () => {
    const { answer, error } = await ask("/save", { moves });
    say(error ?? `saved: crux plan ${answer}`, error);
  });
  const said = Object.assign(made("output", "drag a ring, or choose it and press arrow keys"), { id: "said" });
  bar.append(said);
  bar.querySelector("#undo").disabled = true;
  byId("scene").before(around);
  around.append(byId("scene"), handles);
  for (const name of Object.keys(live.handles)) handles.append(handleOf(name));
  document.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key === "z") { event.preventDefault(); undo(); }
  });
  if (live.follows) {
    const place = Object.assign(made("section"), { id: "stream" }), part = (tag, id, kind) => Object.assign(made(tag, "", kind), { id });
    place.append(made("h2", "Stream of a service: the newest set-points"), Object.assign(made("p", "waiting for set-points that a service publishes"), { id: "stream-words" }), part("p", "stream-lost", "wrong"), part("div", "stream-table", "table"));
    byId("notes").before(place);
    moreTraces.push(lostTiles);
  }
  placeHandles();
}

begin();
start().then(() => {
  if (data.stages[0].status !== "optimal") advise(moves);
  if (live.follows) followStreams();
}).catch(unable);
