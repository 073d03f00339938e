
// Labels over the scene: as plotly's own texts they would lie on each other ----------------------

function pixelOf(point) { // where a point is on the screen, as plotly's own texts find it
  const { glplot, dataScale, container } = byId("scene")._fullLayout.scene._scene;
  let at = [...point.map((c, k) => c * dataScale[k]), 1];
  for (const name of ["model", "view", "projection"]) {
    const m = glplot.cameraParams[name];
    at = [0, 1, 2, 3].map((row) => m[row] * at[0] + m[4 + row] * at[1] + m[8 + row] * at[2] + m[12 + row] * at[3]);
  }
  return [0.5 * (1 + at[0] / at[3]) * container.clientWidth, 0.5 * (1 - at[1] / at[3]) * container.clientHeight];
}

let labels = [], free = [], placedFor = ""; // each with its place and element, the most important first; points to be left free
function drawLabels(scene) {
  const arrows = scene && shownKinds["forces of hands"] ? scene.arrows.filter((a) => a.text) : [], short = (text) => text.length > 30 ? `${text.slice(0, 29)}…` : text;
  const found = (chosen()?.moves ?? []).map((m) => ({ place: middle(m.to ?? m.from), text: m.text, weight: 3, kind: "advice" }));
  const at = (l) => arrows.find((a) => a.kind !== "load" && String(a.start) === String(l.place)); // a hand's force has its name's label
  const named = (scene?.labels ?? []).map((l) => [l, at(l)]);
  for (const [l, arrow] of named) found.push({ place: l.place, text: [short(l.text), ...(arrow ? [arrow.text] : [])].join("\n"), weight: arrow ? 1 + arrow.used / (1 + arrow.used) : l.text === "B" ? 0 : 0.5 });
  for (const a of arrows) if (!named.some(([, arrow]) => arrow === a)) found.push({ place: a.tip, text: short(a.text.split("\n")[0]), weight: 0.8 });
  const before = new Map(labels.map((l) => [l.text, l.choice]));
  labels = found.sort((a, b) => b.weight - a.weight).map((l) => ({ ...l, choice: before.get(l.text), element: made("span", l.text, `label ${l.kind ?? ""}`) }));
  free = scene ? [...scene.tiles.map((t) => t.start), ...scene.labels.map((l) => l.place), ...scene.arrows.flatMap((a) => [a.tip, middle([a.start, a.tip])]), ...(chosen()?.moves ?? []).flatMap((m) => m.to ?? [])] : [];
  byId("labels").replaceChildren(...labels.map((l) => l.element));
  for (const l of labels) l.size = ["Width", "Height"].map((side) => 1 + l.element[`offset${side}`]); // which rounds
  placedFor = "";
}

const labelOffsets = [8, 20, 36, 56].flatMap((far) => [[0, -1], [0, 1], [1, 0], [-1, 0], [1, -1], [-1, -1], [1, 1], [-1, 1]].map(([x, y]) => [x, y, far])); // [pixel]
function placeLabels() { // greedily, the most important first: where one covers no other, and few hands and forces
  requestAnimationFrame(placeLabels);
  const scene = byId("scene")._fullLayout?.scene._scene, camera = scene?.glplot.cameraParams;
  if (!camera?.model) return;
  const { clientWidth: wide, clientHeight: high } = scene.container, now = [wide, high, ...camera.model, ...camera.view, ...camera.projection].join();
  if (now === placedFor) return;
  placedFor = now;
  const taken = [], points = free.map(pixelOf), ways = [];
  for (const label of labels) {
    const [x, y] = pixelOf(label.place), [w, h] = label.size, { element } = label;
    const boxes = labelOffsets.map(([right, down, far], choice) => {
      const left = x + right * far + (right - 1) * w / 2, top = y + down * far + (down - 1) * h / 2;
      const covered = points.filter(([a, b]) => left - 3 < a && a < left + w + 3 && top - 3 < b && b < top + h + 3).length;
      return { left, top, choice, cost: far + 40 * covered - (choice === label.choice ? 10 : 0) }; // it stays rather than jump
    }).filter(({ left, top }) => left >= 0 && top >= 0 && left + w <= wide && top + h <= high
      && taken.every((o) => left >= o.left + o.w || o.left >= left + w || top >= o.top + o.h || o.top >= top + h));
    const best = boxes.reduce((a, b) => !a || b.cost < a.cost ? b : a, null);
    element.classList.toggle("folded", !best);
    element.title = best ? "" : label.text;
    element.style.transform = `translate(${(best?.left ?? x - 5).toFixed(1)}px, ${(best?.top ?? y - 5).toFixed(1)}px)`;
    label.choice = best?.choice;
    if (!best) continue;
    taken.push({ left: best.left, top: best.top, w, h });
    const end = [Math.min(Math.max(x, best.left), best.left + w), Math.min(Math.max(y, best.top), best.top + h)];
    if (labelOffsets[best.choice][2] > 8) ways.push(`M${x.toFixed(1)},${y.toFixed(1)}L${end.map((c) => c.toFixed(1))}`);
  }
  byId("ways").setAttribute("d", ways.join(""));
}
