
// A stance that a person moves: handles over the scene, and the plan of where they are ------------

const live = data.live, token = new URLSearchParams(location.search).get("token") ?? "";
const past = [], future = []; // moves to go back to, and those that were undone
let moves = { body: [0, 0, 0, 0, 0, 0], hands: {} }, sound = moves; // the newest that were planned
let wanted = null, busy = false, resting, planned = 0, slips = null;
let held = false, released = false, aim = null, refused = "", dragTurns = false, slow = false;

async function ask(path, question) {
  try {
    const headers = { "Content-Type": "application/json", "X-Crux-Token": token };
    const reply = await fetch(path, { method: "POST", headers, body: JSON.stringify(question) });
    return reply.ok ? await reply.json() : { error: (await reply.text()).trim() };
  } catch { return { error: "crux view does not answer: it has ended; start it again", gone: true }; }
}

function pixelsAlong(place, axis) { // on the screen, for a metre along an axis in W
  const [from, to] = [pixelOf(place), pixelOf(place.map((c, k) => c + 1e-3 * axis[k]))];
  return [0, 1].map((k) => 1e3 * (to[k] - from[k]));
}

function screenAxes() { // in W: to the right, upward, and away from who looks
  const { eye, center, up } = byId("scene")._fullLayout.scene._scene.getCamera(), list = (v) => [v.x, v.y, v.z];
  const cross = (a, b) => [0, 1, 2].map((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
  const unit = (v) => v.map((c) => c / (Math.hypot(...v) || 1)), ahead = list(center).map((c, k) => c - list(eye)[k]);
  const right = unit(cross(ahead, list(up)));
  return [right, unit(cross(right, ahead)), unit(ahead)];
}

const isBody = (name) => name === "body";
const shiftOf = (all, name) => isBody(name) ? all.body : all.hands[name] ?? [0, 0, 0];
function withShift(name, shift) {
  const rounded = shift.map((c) => Math.round(1e4 * c) / 1e4 + 0); // to a tenth of a millimetre, and of a milliradian
  return isBody(name) ? { ...moves, body: rounded } : { ...moves, hands: { ...moves.hands, [name]: rounded } };
}

function dragged(grip, dx, dy) { // the shift that takes a handle so many pixels on
  const [[ax, ay], [bx, by]] = grip.along, [n, m, o] = [ax * ax + ay * ay, ax * bx + ay * by, bx * bx + by * by];
  const [p, q] = [ax * dx + ay * dy, bx * dx + by * dy], least = 0.01 * (n + o); // an axis seen from its end hardly moves
  const size = (n + least) * (o + least) - m * m, parts = [((o + least) * p - m * q) / size, ((n + least) * q - m * p) / size];
  const along = isBody(grip.name) ? (k) => grip.axes[0][k] * parts[0] + grip.axes[1][k] * parts[1] : (k) => parts[k];
  return grip.shift.map((c, k) => c + (k < live.handles[grip.name].axes.length ? along(k) : 0));
}

function aimed(grip, dx, dy) { // from where the newest plan has the handle: what is curved, or far, would leave the mouse
  const { place } = live.handles[grip.name], [x, y] = pixelOf(place), along = grip.axes.map((axis) => pixelsAlong(place, axis));
  return dragged({ ...grip, along, shift: shiftOf(sound, grip.name) }, grip.at[0] + dx - x, grip.at[1] + dy - y);
}

function aimAgain() { // while the mouse rests with a handle that is beside it
  if (!aim || wanted || !aim.left) return;
  aim.left--;
  const [x, y] = pixelOf(live.handles[aim.name].place);
  if (Math.hypot(aim.at[0] - x, aim.at[1] - y) > 1) aim.move(); // [pixel]
}

function turnedBy(name, shift, turn) { // then by a rotation vector in W, of a hand what of it is about its approach
  if (!isBody(name)) return [...shift.slice(0, 2), shift[2] + live.handles[name].turns.yaw.reduce((sum, c, k) => sum + c * turn[k], 0)];
  const quaternion = (v) => { const size = Math.hypot(...v); return [...v.map((c) => size ? c / size * Math.sin(size / 2) : 0), Math.cos(size / 2)]; };
  const [[a, b, c, d], [x, y, z, w]] = [quaternion(turn), quaternion(shift.slice(3))];
  const found = [d * x + a * w + b * z - c * y, d * y - a * z + b * w + c * x, d * z + a * y - b * x + c * w], real = d * w - a * x - b * y - c * z;
  const size = Math.hypot(...found), angle = 2 * Math.atan2(Math.sign(real || 1) * size, Math.abs(real));
  return [...shift.slice(0, 3), ...found.map((v) => size ? v / size * angle : 0)];
}

function turned(grip, dx, dy) { // 30° for some 100 pixels; a hand as a wheel whose top the mouse has
  const [right, up, ahead] = grip.screen, rate = 0.005, { yaw } = live.handles[grip.name].turns;
  const way = yaw.reduce((sum, c, k) => sum + c * ahead[k], 0) < 0 ? -rate : rate;
  return turnedBy(grip.name, grip.shift, isBody(grip.name) ? up.map((c, k) => rate * (dx * c + dy * right[k])) : yaw.map((c) => way * dx * c));
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
  const list = (numbers, scale) => numbers.map((c) => fixed(scale * c, 1)).join(", "), degrees = 180 / Math.PI;
  const all = Object.entries({ body: moves.body, ...moves.hands }).filter(([, shift]) => shift.some(Boolean)).map(([name, shift]) => {
    const count = live.handles[name].axes.length, [way, turn] = [shift.slice(0, count), shift.slice(count)];
    const parts = way.some(Boolean) ? [`[${list(way, 1e3)}] mm ${isBody(name) ? "in W" : "along its rock"}`] : [];
    if (turn.some(Boolean)) parts.push(isBody(name) ? `turned by [${list(turn, degrees)}]° in W` : `turned by ${list(turn, degrees)}° about its approach`);
    return `${words(name)} ${parts.join(", ")}`;
  });
  say(all.length ? `moved: ${all.join("; ")}` : "as given");
}

function record(before) { // for undo
  past.push(before);
  future.length = 0;
}

function change(next, brief = true) {
  moves = next;
  wanted = { moves, brief };
  byId("undo").disabled = !past.length;
  byId("redo").disabled = !future.length;
  clearTimeout(resting);
  if (brief) resting = setTimeout(() => { wanted = { moves, brief: false }; follow(); }, 300);
  return follow();
}

async function follow() { // one question at a time, the newest
  if (busy) return;
  busy = true;
  while (wanted) {
    const asked = wanted;
    wanted = null;
    const reply = await ask("/plan", asked);
    refused = reply.error ?? "";
    if (refused) say(refused, true);
    else { sound = asked.moves; await take(reply.answer, asked.brief); sayMoves(); aimAgain(); }
    document.body.classList.toggle("stale", Boolean(reply.error) || asked.brief);
    document.body.dataset.planned = ++planned; // questions whose answers are drawn
    if (!reply.error && !asked.brief && !wanted && data.stages[0].status !== "optimal") advise(asked.moves);
  }
  busy = false;
  settle();
}

function settle() { // where a drag has ended at what cannot be: back to the newest plan
  if (!refused || held || busy || !released) return;
  released = false;
  const why = refused;
  change(sound, false).then(() => { if (moves === sound && !refused) say(`back to where it can be: ${why}`); });
}

function keep(surface) { // its numbers themselves, whatever comes in their place
  surface.corners = numbers(surface.corners, Float32Array);
  surface.triangles = numbers(surface.triangles, Uint32Array);
}

const frame = () => new Promise((go) => requestAnimationFrame(() => setTimeout(go)));

function hurry(moving) { // while the mouse moves nobody hovers; and what is slow to draw is drawn coarsely
  const { glplot } = byId("scene")._fullLayout.scene._scene, sharp = config.plotGlPixelRatio;
  for (const object of glplot.objects) if (moving) object.drawPick = null; else delete object.drawPick;
  if (moving) glplot.gl.readPixels = () => {}; // it would wait until all is drawn
  else delete glplot.gl.readPixels;
  glplot.pixelRatio = moving && slow ? sharp / 2 : sharp;
}

async function take({ stage, meshes, handles }, brief) {
  const rock = (brief ? data.stages[0] : stage).scene.surfaces.filter((s) => s.kind === "rock"); // it stays
  data.meshes.splice(live.kept, Infinity, ...meshes);
  for (const index of unpacked.keys()) if (index >= live.kept) unpacked.delete(index);
  live.handles = handles;
  drawnAdvice = null;
  data.stages[0] = brief ? { ...data.stages[0], advice: null, ...stage } : stage;
  if (brief) stage.scene.surfaces.push(...rock);
  else rock.forEach(keep);
  hurry(brief);
  if (!brief) { widen(); return show(); }
  const began = performance.now();
  showOutcome(stage);
  await drawScene();
  await frame();
  slow ||= performance.now() - began > 60; // [ms], as without a graphics card
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
  const keys = isBody(name) ? "keys R, P, Y" : "key Y";
  handle.setAttribute("aria-label", `${words(name)}: drag, or arrow keys by 1 mm, with shift by 10 mm; turn with ${keys} by 1°, with shift back`);
  handle.title = words(name);
  let grip = null;
  handle.onpointerdown = (event) => {
    if (event.button) return;
    const { place, axes: own } = live.handles[name], screen = screenAxes(), axes = isBody(name) ? screen.slice(0, 2) : own;
    held = true;
    grip = { name, axes, screen, turns: event.shiftKey || dragTurns, at: pixelOf(place), shift: shiftOf(moves, name), before: moves, x: event.clientX, y: event.clientY };
    handle.setPointerCapture(event.pointerId);
  };
  handle.onpointermove = (event) => {
    if (!grip) return;
    const [dx, dy] = [event.clientX - grip.x, event.clientY - grip.y];
    if (!grip.moved && Math.hypot(dx, dy) < 3) return; // a click chooses alone
    if (!grip.moved) record(grip.before);
    grip.moved = true;
    const now = grip, move = () => change(withShift(name, (now.turns ? turned : aimed)(now, dx, dy)));
    aim = now.turns ? null : { name, move, left: 3, at: [now.at[0] + dx, now.at[1] + dy] };
    move();
  };
  handle.onpointerup = handle.onpointercancel = () => {
    released = Boolean(grip?.moved);
    grip = aim = null; held = false;
    settle();
  };
  handle.onkeydown = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const axis = live.handles[name].turns[{ r: "roll", p: "pitch", y: "yaw" }[event.key.toLowerCase()]], angle = (event.shiftKey ? -1 : 1) * Math.PI / 180;
    if (!axis && !event.key.startsWith("Arrow")) return;
    event.preventDefault();
    record(moves);
    released = false;
    change(withShift(name, axis ? turnedBy(name, shiftOf(moves, name), axis.map((c) => angle * c)) : stepped(name, event.key, event.shiftKey ? 0.01 : 0.001)));
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

function goTo(from, back) { // of what is kept, to the newest; back: where the present goes
  if (!from.length) return;
  back.push(moves);
  change(from.pop(), false);
}
const undo = () => goTo(past, future), redo = () => goTo(future, past);

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
  const around = byId("scene").parentElement, handles = Object.assign(made("div"), { id: "handles" }), bar = made("div", "", "buttons");
  const button = (text, id, press) => bar.append(Object.assign(made("button", text), { id, onclick: press }));
  button("undo", "undo", undo);
  button("redo", "redo", redo);
  const turner = Object.assign(made("button", "drag turns"), { id: "turn", title: "as with the shift key" });
  turner.setAttribute("aria-pressed", false);
  turner.onclick = () => { dragTurns = !dragTurns; turner.setAttribute("aria-pressed", dragTurns); };
  bar.append(turner);
  byId("views").before(bar);
  button("save as stance", "save", async () => {
    const { answer, error } = await ask("/save", { moves });
    say(error ?? `saved: crux plan ${answer}`, error);
  });
  const said = Object.assign(made("output", "drag a ring, with shift to turn it; or choose it, and press arrow keys, or R, P or Y"), { id: "said" });
  for (const each of bar.querySelectorAll("#undo, #redo")) each.disabled = true;
  around.append(handles);
  const pressed = (event) => { if (event.buttons && (held || handles.contains(event.relatedTarget))) event.stopPropagation(); };
  for (const kind of ["mouseover", "mouseout", "mouseenter", "mouseleave"]) around.addEventListener(kind, pressed, true); // plotly would turn the camera, too
  around.after(said); // below: what it says must not move the scene under the mouse
  document.body.classList.add("live");
  for (const name of Object.keys(live.handles)) handles.append(handleOf(name));
  document.addEventListener("keydown", (event) => {
    const key = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || (key !== "z" && key !== "y")) return;
    event.preventDefault();
    (key === "y" || event.shiftKey ? redo : undo)();
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
  data.stages[0].scene.surfaces.filter((s) => s.kind === "rock").forEach(keep);
  if (data.stages[0].status !== "optimal") advise(moves);
  if (live.follows) followStreams();
}).catch(unable);
