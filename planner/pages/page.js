"use strict";
const byId = (name) => document.getElementById(name);
const data = JSON.parse(byId("data").textContent);
const hasRobot = data.stages.some((stage) => stage.scene?.arrows.length);
const shownKinds = { rock: true, ...(hasRobot ? { robot: true, "forces of hands": true, "forces of tiles": false } : {}) };
for (const group of data.groups ?? []) shownKinds[group.name] = true;
const moreTraces = []; // functions of a scene
let at = data.crux ?? 0, order = {}, drawnAdvice = null, ranges;

const dark = matchMedia("(prefers-color-scheme: dark)"), { overload, dark_overload } = data.colours;
Object.defineProperty(data.colours, "overload", { get: () => dark.matches ? dark_overload : overload });
const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const made = (tag, text, kind) => Object.assign(document.createElement(tag), { textContent: text ?? "", className: kind ?? "" });
const words = (name) => name.replaceAll("_", " ");
const plain = (text) => words(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;"); // plotly reads tags
const fixed = (value, digits) => Number.isFinite(value) ? value.toFixed(digits) : "–";

function bytesOf(text) { return Uint8Array.from(atob(text), (c) => c.charCodeAt(0)); }
const unpacked = new Map();
function numbers(index, kind) { // or numbers themselves
  if (typeof index !== "number") return index;
  if (!unpacked.has(index)) unpacked.set(index, new kind(bytesOf(data.meshes[index]).buffer));
  return unpacked.get(index);
}

function colourOf(used) { // as the still pictures have it: straight lines between the colours
  if (used === null || used === undefined) return ink("load");
  if (used > 1) return data.colours.overload;
  const known = data.colours.utilisation, place = Math.max(used, 0) * (known.length - 1);
  const i = Math.min(Math.floor(place), known.length - 2), part = place - i;
  const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
  const [low, high] = [rgb(known[i]), rgb(known[i + 1])];
  return `rgb(${low.map((c, k) => Math.round(c + part * (high[k] - c))).join(",")})`;
}

// The scene ----------------------------------------------------------------------------------

function* placed({ pose }, corners) { // in W
  for (let n = 0; n < corners.length; n += 3) {
    const [x, y, z] = corners.subarray(n, n + 3);
    yield pose ? [0, 4, 8].map((k) => pose[k] * x + pose[k + 1] * y + pose[k + 2] * z + pose[k + 3]) : [x, y, z];
  }
}

function meshOf(surfaces, more) { // many surfaces as one mesh, its text at each corner
  const mesh = { type: "mesh3d", x: [], y: [], z: [], i: [], j: [], k: [], hoverinfo: "skip", ...more };
  for (const surface of surfaces) {
    const first = mesh.x.length;
    const corners = numbers(surface.corners, Float32Array), triangles = numbers(surface.triangles, Uint32Array);
    for (const [x, y, z] of placed(surface, corners)) { mesh.x.push(x); mesh.y.push(y); mesh.z.push(z); }
    for (let n = 0; n < triangles.length; n += 3) {
      mesh.i.push(first + triangles[n]); mesh.j.push(first + triangles[n + 1]); mesh.k.push(first + triangles[n + 2]);
    }
  }
  return { ...mesh, ...unlessEmpty(mesh) };
}

const unlessEmpty = ({ x }) => x.length ? {} : { visible: false }; // what is empty costs time, too

function linesOf(lines, more) { // polylines as one trace, with gaps
  const trace = { type: "scatter3d", mode: "lines", x: [], y: [], z: [], hoverinfo: "skip", ...more };
  for (const points of lines) {
    for (const [x, y, z] of points) { trace.x.push(x); trace.y.push(y); trace.z.push(z); }
    trace.x.push(null); trace.y.push(null); trace.z.push(null);
  }
  return { ...trace, ...unlessEmpty(trace) };
}

function dotsOf(points, more) {
  const [x, y, z] = [0, 1, 2].map((k) => points.map((p) => p[k]));
  return { type: "scatter3d", mode: "markers", x, y, z, hoverinfo: "skip", ...more, ...unlessEmpty({ x }) };
}

function tilesOf(tiles, visible) {
  const corners = tiles.flatMap((t) => t.corners), [x, y, z] = [0, 1, 2].map((k) => corners.map((c) => c[k]));
  const of = (a) => tiles.flatMap((_, n) => a.map((corner) => 4 * n + corner));
  const colours = tiles.map((t) => colourOf(t.used ?? Infinity));
  const text = tiles.map((t) => `${plain(t.limb)}, ${plain(t.finger)}, ${plain(t.phalanx)}<br>utilisation ${fixed(t.used, 2)}<br>`
    + `shear ${fixed(t.shear, 1)} N, normal ${fixed(t.normal, 1)} N, lateral ${fixed(t.lateral, 1)} N`);
  return [
    { type: "mesh3d", x, y, z, i: of([0, 0]), j: of([1, 2]), k: of([2, 3]), hoverinfo: "skip",
      facecolor: colours.flatMap((c) => [c, c]), lighting: { ambient: 1, diffuse: 0 }, meta: "tiles" },
    dotsOf(tiles.map((t) => t.start), { text, hovertemplate: "%{text}<extra></extra>",
      marker: { size: 3, color: colours, line: { color: ink("ink"), width: 1 } } }),
    linesOf(tiles.map((t) => [t.start, t.tip]), { meta: "forces of tiles", visible,
      line: { width: 3, color: tiles.flatMap((t, n) => [colours[n], colours[n], colours[n]]) } }),
  ];
}

function arrowsOf(arrows, visible) { // their heads are pyramids of one mesh
  const more = { meta: "forces of hands", visible }, colours = arrows.map((arrow) => colourOf(arrow.used)), sides = [0, 1, 2, 3, 4, 5];
  const corners = arrows.flatMap(({ start, tip }) => {
    const step = tip.map((t, k) => t - start[k]), size = Math.hypot(...step) || 1, head = Math.min(0.06, size), [x, y, z] = step.map((c) => c / size);
    const aside = Math.abs(z) > 0.9 ? [0, z, -y] : [y, -x, 0], width = Math.hypot(...aside) || 1, u = aside.map((c) => c / width);
    const v = [y * u[2] - z * u[1], z * u[0] - x * u[2], x * u[1] - y * u[0]];
    return [tip, ...sides.map((n) => tip.map((t, k) => t - head * ([x, y, z][k] - 0.35 * (Math.cos(n * Math.PI / 3) * u[k] + Math.sin(n * Math.PI / 3) * v[k]))))];
  });
  const [x, y, z] = [0, 1, 2].map((k) => corners.map((c) => c[k])), of = (step) => arrows.flatMap((_, n) => sides.map((side) => 7 * n + step(side)));
  const hovertext = arrows.map((a) => `${plain(a.text).replaceAll("\n", "<br>")}<br>[${a.force.map((f) => fixed(f, 0)).join(", ")}] N in W`
    + (a.kind === "load" ? "" : `<br>utilisation of the hand ${fixed(a.used, 2)}`));
  return [
    linesOf(arrows.map((a) => [a.start, a.tip]), { ...more, line: { width: 7, color: colours.flatMap((c) => [c, c, c]) } }),
    { type: "mesh3d", x, y, z, i: of(() => 0), j: of((n) => n + 1), k: of((n) => (n + 1) % 6 + 1), hoverinfo: "skip", ...more,
      facecolor: colours.flatMap((c) => sides.map(() => c)), lighting: { ambient: 0.9 } },
    dotsOf(arrows.map((a) => a.tip), { ...more, hovertext, hovertemplate: "%{hovertext}<extra></extra>", marker: { size: 5, color: colours } }),
  ];
}

function groupTraces() { // places that were tried: coloured by a value, or all alike
  const symbols = ["circle-open", "diamond-open", "square-open", "diamond", "square", "circle"]; // others lack in many fonts
  const colorbar = (text) => ({ title: { text, side: "top", font: { color: ink("dim") } }, orientation: "h", y: 0, yanchor: "bottom",
    thickness: 8, len: 0.6, tickfont: { color: ink("dim") } });
  return (data.groups ?? []).map((g, n) => dotsOf(g.places, { meta: g.name, visible: shownKinds[g.name], text: g.texts?.map((t) => plain(t).replaceAll("\n", "<br>")),
    hoverinfo: g.texts || g.template ? "all" : "skip", hovertemplate: (g.texts || g.template) && `${g.template ?? "%{text}"}<extra></extra>`,
    marker: g.values ? { size: 6, line: { color: ink("ink"), width: 1 }, color: g.values, cmin: Math.min(0, ...g.values), cmax: Math.max(...g.values) || 1, colorscale: "Viridis", showscale: true, colorbar: colorbar(g.label) }
      : { size: 3.5, symbol: symbols[n % 6], color: ink(["dim", "finger", "link"][n % 3]) } }));
}

const chosen = () => data.stages[at].advice?.[drawnAdvice];
const middle = (points) => [0, 1, 2].map((k) => points.reduce((sum, p) => sum + p[k], 0) / points.length);
function adviceTraces() { // palms and limbs after the change, and the ways there
  if (!chosen()?.moves) return [];
  const { moves, limbs } = chosen(), ring = (points) => [...points, points[0]], of = (end) => moves.flatMap((m) => m[end] ? [ring(m[end])] : []);
  const both = moves.filter((m) => m.from && m.to), more = { meta: "advice" };
  return [
    linesOf(of("from"), { ...more, line: { width: 4, color: ink("dim") } }), linesOf(of("to"), { ...more, line: { width: 6, color: ink("advice") } }),
    linesOf(both.map((m) => [middle(m.from), middle(m.to)]), { ...more, line: { width: 6, color: ink("advice") } }),
    linesOf(limbs, { ...more, line: { width: 3, color: ink("advice"), dash: "dash" } }),
    dotsOf(moves.filter((m) => m.to).map((m) => middle(m.to)), { ...more, marker: { size: 6, color: ink("advice") } }),
  ];
}

function sceneTraces(scene) {
  const of = (kind) => scene.surfaces.filter((s) => s.kind === kind), flat = { flatshading: true };
  const points = (kind) => scene.dots.filter((d) => d.kind === kind).flatMap((d) => d.points);
  const robot = { meta: "robot", visible: shownKinds.robot }, joints = scene.dots.filter((d) => d.kind === "joint");
  const lighting = { ambient: 0.8, diffuse: 0.4, specular: 0.05, roughness: 0.9 };
  return [
    meshOf(of("rock"), { meta: "rock", visible: shownKinds.rock, color: ink("rock"), opacity: 0.6, lighting, ...flat }),
    meshOf(of("palm"), { color: ink("palm"), lighting: { ambient: 0.8 }, meta: "palms" }),
    meshOf(of("body"), { ...robot, color: ink("body"), opacity: 0.5, lighting }),
    meshOf(of("mesh"), { ...robot, color: ink("body"), lighting }),
    meshOf(of("link"), { ...robot, color: ink("link"), opacity: 0.35, lighting }),
    linesOf(scene.lines.filter((l) => l.kind === "limb").map((l) => l.points), { ...robot, line: { width: 6, color: ink("limb") } }),
    linesOf(scene.lines.filter((l) => l.kind === "finger").map((l) => l.points), { line: { width: 4, color: ink("finger") } }),
    dotsOf(joints.flatMap((d) => d.points), { ...robot, hovertemplate: "%{text}<extra></extra>",
      text: joints.flatMap((d) => d.points.map((_, n) => `joint ${n + 1}` + (d.used ? `: utilisation ${d.used[n].toFixed(2)}` : ""))),
      marker: { size: 4, color: joints.flatMap((d) => d.points.map((_, n) => d.used ? colourOf(d.used[n]) : ink("back"))),
        line: { color: ink("limb"), width: 1 } } }),
    dotsOf(points("load"), { marker: { size: 6, color: ink("load") } }),
    ...groupTraces(), ...adviceTraces(),
    ...tilesOf(scene.tiles, shownKinds["forces of tiles"]),
    ...arrowsOf(scene.arrows, shownKinds["forces of hands"]),
    ...moreTraces.flatMap((each) => each(scene)),
  ];
}

const config = { displaylogo: false, responsive: true, displayModeBar: false, plotGlPixelRatio: devicePixelRatio };
const axis = (title) => ({ title: { text: title }, color: ink("dim"), gridcolor: ink("line"), zerolinecolor: ink("line"),
  backgroundcolor: ink("back"), showspikes: false });
const vector = (v, length) => Object.fromEntries(["x", "y", "z"].map((c, k) => [c, length * v[k]]));
function cameraOf(view) { // farther away in a narrow window, and from what is flat
  const { clientWidth, clientHeight } = byId("scene"), sizes = ranges.map(([low, high]) => high - low);
  const flat = Math.max(...sizes) / Math.cbrt(sizes[0] * sizes[1] * sizes[2]), titles = data.groups || data.live ? 1.25 : 1.1;
  const far = 1.75 * Math.max(1, flat) * Math.max(1, titles * clientHeight / clientWidth);
  return { eye: vector(view.eye, far), up: vector(view.up, 1), center: vector([0, 0, 0], 0) };
}

let camera;
function keptCamera() { // where a person has turned it; plotly's own would drift by rounding
  const now = byId("scene")._fullLayout.scene._scene.getCamera();
  const same = ["eye", "up", "center"].every((name) => ["x", "y", "z"].every((c) => Math.abs(now[name][c] - camera[name][c]) < 1e-6));
  return same ? camera : now;
}

function bounds(spare = 0.05) { // of all stages and places, so that the view stays still
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const add = (p) => p.forEach((v, k) => { if (Number.isFinite(v)) { low[k] = Math.min(low[k], v); high[k] = Math.max(high[k], v); } });
  for (const { scene, advice } of data.stages) {
    for (const surface of scene?.surfaces ?? []) for (const corner of placed(surface, numbers(surface.corners, Float32Array))) add(corner);
    scene?.arrows.forEach((arrow) => add(arrow.tip));
    advice?.forEach((a) => a.moves?.forEach((m) => m.to?.forEach(add)));
  }
  for (const { places } of data.groups ?? []) places.forEach(add);
  return [0, 1, 2].map((k) => low[k] > high[k] ? [-1, 1] : [low[k] - spare, high[k] + spare]);
}

function drawScene(view) {
  const scene = data.stages[at].scene;
  const axes = Object.fromEntries(["x", "y", "z"].map((c, k) => [`${c}axis`, { ...axis(`${c} of ${data.frame ?? "W"} [m]`), range: ranges[k], nticks: 4 }]));
  const layout = { margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: ink("back"), showlegend: false, uirevision: "kept",
    hoverlabel: { align: "left" }, scene: { ...axes, domain: { y: [data.groups?.some((g) => g.values) ? 0.12 : 0, 1] }, // above the bar of colours
      aspectmode: "data", dragmode: "turntable" } };
  layout.scene.camera = camera = view ? cameraOf(view) : keptCamera();
  drawLabels(scene);
  return Plotly.react(byId("scene"), scene ? sceneTraces(scene) : [], layout, config);
}

// Slices, margin, tables, notes ----------------------------------------------------------------

const flatAxis = (title) => ({ title: { text: title }, color: ink("dim"), gridcolor: ink("line"), zerolinecolor: ink("dim"), automargin: true });
const flatLayout = (more) => ({ margin: { l: 50, r: 10, t: 30, b: 40 }, paper_bgcolor: ink("back"), plot_bgcolor: ink("back"),
  showlegend: false, font: { color: ink("ink") }, dragmode: false, ...more });

function drawSlices(slices) {
  byId("spaces").hidden = !slices.length;
  const place = byId("slices");
  while (place.children.length > slices.length) { Plotly.purge(place.lastChild); place.lastChild.remove(); }
  while (place.children.length < slices.length) place.append(made("div", "", "slice"));
  slices.forEach((slice, n) => {
    const outline = (corners, name, more) => ({ type: "scatter", mode: "lines", fill: "toself", name, hoverinfo: "skip",
      x: [...corners, corners[0]].map((c) => c?.[0]), y: [...corners, corners[0]].map((c) => c?.[1]), ...more });
    const colour = ink("load"), traces = [outline(slice.whole, "any", { line: { color: colour, width: 1 }, opacity: 0.35 })];
    if (slice.held) traces.push(outline(slice.held, "used", { line: { color: colour, width: 2 }, opacity: 0.9 }));
    traces.push({ type: "scatter", mode: "markers", x: [slice.used[0]], y: [slice.used[1]], text: [fixed(slice.utilisation, 2)],
      marker: { size: 11, color: colourOf(slice.utilisation ?? Infinity), line: { color: ink("ink"), width: 1.5 } },
      hovertemplate: "F<sub>x</sub> %{x:.1f} N, F<sub>z</sub> %{y:.1f} N<br>utilisation %{text}<extra></extra>" });
    Plotly.react(place.children[n], traces, flatLayout({ title: { text: plain(slice.limb), font: { size: 14 } },
      xaxis: flatAxis("F<sub>x</sub> in H [N]"), yaxis: flatAxis("F<sub>z</sub> in H [N]") }), config);
  });
}

function drawMargin() {
  const stages = data.stages, bound = data.bound ?? null, measure = data.margin ?? "margin to the limit";
  const margins = stages.map((s) => data.margin ? s.load_factor ?? null : Number.isFinite(s.utilisation) ? s.limit - s.utilisation : null);
  const names = stages.map((s, n) => `${n} · ${plain(s.name)}`), known = margins.filter((m) => m !== null);
  const low = Math.max(Math.min(0, ...known), -1);
  const text = stages.map((s, n) => margins[n] === null ? s.status : `${measure} ${fixed(margins[n], 2)}, utilisation ${fixed(s.utilisation, 2)}`);
  const bars = { type: "bar", x: stages.map((_, n) => n), y: margins.map((m) => m === null ? 0 : Math.max(m, low)), text: names, customdata: text,
    textposition: "none", hovertemplate: "%{text}<br>%{customdata}<extra></extra>",
    marker: { color: stages.map((s) => colourOf(s.utilisation ?? 2)), line: { color: ink("ink"), width: stages.map((_, n) => n === at ? 3 : 0) } } };
  const none = { type: "scatter", mode: "markers", x: stages.map((_, n) => n).filter((n) => margins[n] === null), hoverinfo: "skip",
    marker: { symbol: "x", size: 10, color: data.colours.overload } };
  none.y = none.x.map(() => 0);
  const line = { type: "scatter", mode: "lines", x: [-0.5, stages.length - 0.5], y: [bound, bound], line: { color: ink("ink"), dash: "dash" },
    hovertemplate: "no climb has more in all stages: %{y:.3f}<extra></extra>" };
  const crux = { visible: data.crux !== undefined, x: data.crux, y: margins[data.crux] ?? 0, text: "crux", showarrow: true, arrowhead: 2, ax: 0, ay: -28, arrowcolor: ink("ink") };
  return Plotly.react(byId("margin"), bound === null ? [bars, none] : [bars, none, line], flatLayout({ margin: { l: 50, r: 10, t: 32, b: 40 }, annotations: [crux],
    xaxis: { ...flatAxis("stage"), zeroline: false, dtick: stages.length > 25 ? 5 : 1 }, yaxis: flatAxis(`${measure} [1]`) }), config);
}

function written(value) {
  if (value === null || value === undefined) return "–";
  if (typeof value !== "number" || Number.isInteger(value)) return String(value);
  return Math.abs(value) < 1e-6 ? "0" : Math.abs(value) < 0.1 ? value.toPrecision(2) : value.toFixed(Math.abs(value) < 10 ? 2 : 1);
}

function drawTable(table, place) {
  const columns = table.columns.split(",");
  const sorted = order[table.title], rows = [...table.rows];
  const compare = (a, b) => (a === null) - (b === null) || sorted.sign * (typeof a === "number" ? a - b : String(a).localeCompare(String(b)));
  if (sorted) rows.sort((a, b) => compare(a[sorted.column] ?? null, b[sorted.column] ?? null)); // what is not there is last
  const shown = made("table"), head = shown.createTHead().insertRow(), body = shown.createTBody();
  const isWord = columns.map((_, n) => table.rows.some((row) => typeof row[n] === "string"));
  columns.forEach((column, n) => {
    const cell = made("th", "", isWord[n] ? "words" : ""), button = made("button", column);
    if (sorted?.column === n) cell.ariaSort = sorted.sign > 0 ? "ascending" : "descending";
    button.onclick = () => { // numbers begin with the largest
      const first = isWord[n] ? 1 : -1;
      order[table.title] = { column: n, sign: sorted?.column === n ? -sorted.sign : first };
      drawTable(table, place);
      place.querySelectorAll("th button")[n].focus({ preventScroll: true });
    };
    cell.append(button); head.append(cell);
  });
  for (const row of rows) {
    const line = body.insertRow();
    row.forEach((value, n) => {
      const cell = Object.assign(line.insertCell(), { textContent: written(value), className: isWord[n] ? "words" : "" });
      if (columns[n].includes("utilisation") && value !== null) { cell.className = "used"; cell.style.setProperty("--used", colourOf(value)); }
    });
  }
  place.replaceChildren(shown);
}

function titled(level, table) {
  const place = made("div", "", "table");
  drawTable(table, place);
  return [made(level, table.title), place];
}

function listed(title, lines) {
  const list = made("ul");
  lines.forEach((line) => list.append(made("li", line)));
  byId("notes").append(made("h2", title), list);
}

function listedAdvice(advice) {
  listed("Advice: changes that were planned and verified", advice.map((a) => `${a.holds ? "holds" : "less overloaded"}, utilisation ${fixed(a.utilisation, 3)}: ${a.sentence} `));
  advice.forEach((a, n) => {
    if (!a.moves) return;
    const button = made("button", drawnAdvice === n ? "hide" : "draw");
    button.setAttribute("aria-pressed", drawnAdvice === n);
    button.onclick = async () => {
      drawnAdvice = drawnAdvice === n ? null : n;
      await show();
      byId("notes").querySelectorAll("li button")[advice.slice(0, n).filter((b) => b.moves).length].focus({ preventScroll: true });
    };
    byId("notes").querySelectorAll("li")[n].append(button);
  });
  if (chosen()?.table) byId("notes").append(...titled("h3", chosen().table));
}

function showOutcome(stage) {
  const within = (name) => { // the interval over samples, if there were any
    const ends = stage.spread?.[name];
    return ends ? ` (${[...new Set(ends.map((end) => fixed(end, 2)))].join(" to ")})` : "";
  };
  const parts = Number.isFinite(stage.utilisation) ? [`utilisation ${fixed(stage.utilisation, 2)}${within("utilisation")} of ${stage.limit}`] : [];
  if (Number.isFinite(stage.load_factor)) parts.push(`load factor ${fixed(stage.load_factor, 2)}${within("load_factor")}`);
  else if (stage.load_factor_status === "unbounded") parts.push("load factor unbounded");
  byId("outcome").replaceChildren(made("span", stage.status, `status ${stage.status}`), parts.join(", "));
  byId("sentence").textContent = [stage.sentence, stage.tied].filter(Boolean).join("; ");
}

function showWords(stage) {
  showOutcome(stage);
  byId("notes").replaceChildren();
  if (stage.advice?.length) listedAdvice(stage.advice);
  else if (stage.advice) listed("Advice", ["no change that was tried helps"]);
  if (stage.sure?.length || stage.samples) listed("How sure", stage.sure ?? []);
  if (stage.samples) byId("notes").append(...titled("h3", stage.samples));
  if (stage.warnings?.length) listed("Warnings", stage.warnings);
  byId("tables").replaceChildren(...(stage.tables ?? []).flatMap((table) => titled("h2", table)));
}

// Together ---------------------------------------------------------------------------------------

async function show(view) {
  const stage = data.stages[at];
  showWords(stage);
  await drawScene(view);
  performance.mark("scene drawn");
  await new Promise((go) => setTimeout(go)); // the picture first
  if (stage !== data.stages[at]) return; // another was asked for meanwhile
  if (data.stages.length > 1) {
    byId("stage").value = at;
    byId("where").textContent = `stage ${at} of ${data.stages.length - 1}: ${words(stage.name)}` + (at === data.crux ? ", the crux" : "");
    await drawMargin();
  }
  drawSlices(stage.slices ?? []);
  document.body.dataset.shown = at;
}

async function start() {
  byId("title").textContent = data.title;
  byId("about").replaceChildren(...(data.said ?? []).flatMap((line) => [line, made("br")]));
  byId("colours").style.background = `linear-gradient(to right, ${data.colours.utilisation.join(",")})`;
  byId("scale").hidden = !hasRobot;
  byId("over").style.background = data.colours.overload;
  const packed = (await fetch(`data:;base64,${byId("plotly").textContent}`)).body.pipeThrough(new DecompressionStream("gzip"));
  document.head.append(made("script", await new Response(packed).text()));
  ranges = bounds(data.live ? 0.2 : 0.05); // [m] that what is dragged stays in sight
  const views = data.stages.find((s) => s.scene)?.scene.views ?? {};
  for (const [name, view] of Object.entries(views)) {
    const button = made("button", name);
    button.onclick = () => Plotly.relayout(byId("scene"), { "scene.camera": cameraOf(view) });
    byId("views").append(button);
  }
  for (const name of Object.keys(shownKinds)) {
    const count = data.groups?.find((g) => g.name === name)?.places.length, label = made("label", count === undefined ? ` ${name}` : ` ${name} (${count})`), box = Object.assign(made("input"), { type: "checkbox", checked: shownKinds[name] });
    box.onchange = () => { shownKinds[name] = box.checked; show(); };
    label.prepend(box); byId("views").append(label);
  }
  const go = (stage) => { at = Math.min(Math.max(stage, 0), data.stages.length - 1); drawnAdvice = null; return show(); };
  if (data.stages.length > 1) {
    byId("along").hidden = false;
    byId("stage").max = data.stages.length - 1;
    byId("stage").oninput = () => go(Number(byId("stage").value));
    byId("before").onclick = () => go(at - 1);
    byId("after").onclick = () => go(at + 1);
  }
  await show(Object.values(views)[0]);
  placeLabels();
  if (data.stages.length > 1) byId("margin").on("plotly_click", (event) => go(event.points[0].x));
  dark.addEventListener("change", () => show());
}

function unable(error) {
  byId("sentence").append(made("strong", ` This page cannot be drawn here: ${error.message}`));
  console.error(error);
}
