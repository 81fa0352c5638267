// Head, curves along an axis, sensitivity, stalls of the table's rows, impossible combinations; then everything starts.

const SVG = "http://www.w3.org/2000/svg";

function svgElement(name, attributes, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

function head() {
  byId("question").textContent = DATA.question;
  byId("summary").textContent = DATA.summary;
  byId("about").replaceChildren(...DATA.about.map(([name, text]) => element("div", {}, element("dt", {}, name), element("dd", {}, text))));
}

function curveControls() {
  const select = byId("curve-axis");
  byId("curves").hidden = DATA.curves.length === 0;
  DATA.curves.forEach((c, k) => select.append(element("option", { value: k }, DATA.axes[c.axis].name)));
  select.addEventListener("change", drawCurves);
  listeners.pick.push(drawCurves);
}

function drawCurves() {
  const curve = DATA.curves[Number(byId("curve-axis").value || 0)];
  if (!curve) return;
  byId("curve-along").textContent = curve.along ? `Lines: ${curve.along}. Pale: all measured points.` : "";
  byId("curve-panels").replaceChildren(...curve.metrics.map((m) => panel(curve, m)));
  byId("curve-legend").replaceChildren(...curve.optima.map(([m, at], k) => element("span", {},
    element("i", { className: "swatch", style: `background:${OPTIMA[k % OPTIMA.length]}` }), `best ${DATA.metrics[m].name} at ${curve.x[at]}`)));
  byId("curve-reasons").replaceChildren(...curve.optima.map(([, , reason]) => element("li", {}, reason)),
    ...(curve.limits ? [element("li", {}, curve.limits)] : []));
}

function panel(curve, m) {
  const metric = DATA.metrics[m], axis = DATA.axes[curve.axis];
  const column = COLUMNS.find((c) => c.metric === m), xColumn = COLUMNS.find((c) => c.isAxis && c.name === axis.name);
  const [width, height, left, right, top, bottom] = [420, 220, 66, 408, 26, 184];
  const svg = svgElement("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${metric.name} against ${axis.name}` });
  const all = [];
  for (let i = 0; i < COUNT; i++) if (isMeasured(i) && column.number(i) !== null && xColumn.number(i) !== null) all.push(i);
  const known = curve.x.map((x, k) => [x, curve.y[m][k]]).filter(([, y]) => y !== null);
  const wide = Math.min(...curve.x) > 0 && Math.max(...curve.x) > 12 * Math.min(...curve.x);
  const xs = scale(curve.x.concat(all.map(xColumn.number)), wide, left, right);
  const ys = scale(all.map(column.number).concat(known.map((k) => k[1])), false, bottom, top, true);
  if (!xs || !ys) return svg;
  svg.append(svgElement("text", { x: left, y: 16 }, metric.name + (metric.unit ? ` (${metric.unit})` : "")));
  svg.append(svgElement("title", {}, metric.what));
  for (const y of ticks(ys.low, ys.high, false, 5)) {
    const py = ys.pixel(y);
    svg.append(svgElement("line", { x1: left, x2: right, y1: py, y2: py, stroke: "var(--grid)" }));
    // A long unit stands in the title alone.
    const words = shown(y, metric.unit.length > 2 ? "1/" : metric.unit).replace(/\/$/, "");
    svg.append(svgElement("text", { x: left - 6, y: py + 4, "text-anchor": "end" }, words.trim()));
  }
  let last = -Infinity;
  for (const x of wide ? curve.x : ticks(xs.low, xs.high, false, 7)) {
    const px = xs.pixel(x);
    if (px - last < 26) continue;
    last = px;
    svg.append(svgElement("line", { x1: px, x2: px, y1: top, y2: bottom, stroke: "var(--grid)" }));
    svg.append(svgElement("text", { x: px, y: bottom + 16, "text-anchor": "middle" }, String(x)));
  }
  svg.append(svgElement("text", { x: (left + right) / 2, y: bottom + 32, "text-anchor": "middle", class: "soft" }, axis.name));
  const dots = new Set(), put = (x, y) => `M${x} ${y}h0`;
  if (all.length > known.length) {
    for (const i of all) dots.add(put(Math.round(xs.pixel(xColumn.number(i))), Math.round(ys.pixel(column.number(i)))));
    svg.append(svgElement("path", { d: [...dots].join(""), stroke: "var(--dim)", "stroke-opacity": 0.45, "stroke-width": 4, "stroke-linecap": "round" }));
  }
  curve.optima.forEach(([o, at], k) => {
    const px = xs.pixel(curve.x[at]) + (k - (curve.optima.length - 1) / 2) * 2;
    svg.append(svgElement("line", { x1: px, x2: px, y1: top, y2: bottom, stroke: OPTIMA[k % OPTIMA.length], "stroke-dasharray": "5 4", "stroke-width": 1.5 }));
  });
  const path = known.map(([x, y], k) => `${k ? "L" : "M"}${xs.pixel(x).toFixed(1)} ${ys.pixel(y).toFixed(1)}`).join("");
  svg.append(svgElement("path", { d: path, fill: "none", stroke: "var(--front)", "stroke-width": 2 }));
  for (const [x, y] of known) {
    const dot = svgElement("circle", { cx: xs.pixel(x), cy: ys.pixel(y), r: 3.5, fill: "var(--front)" });
    dot.append(svgElement("title", {}, `${axis.name} = ${x}: ${metric.name} ${shown(y, metric.unit)}`));
    svg.append(dot);
  }
  curve.optima.forEach(([o, at], k) => {
    if (o !== m || curve.y[m][at] === null) return;
    svg.append(svgElement("circle", { cx: xs.pixel(curve.x[at]), cy: ys.pixel(curve.y[m][at]), r: 7, fill: "none", stroke: OPTIMA[k % OPTIMA.length], "stroke-width": 2 }));
  });
  const i = state.picked;
  if (i !== null && column.number(i) !== null && xColumn.number(i) !== null) {
    svg.append(svgElement("circle", { cx: xs.pixel(xColumn.number(i)), cy: ys.pixel(column.number(i)), r: 5, fill: "none", stroke: "var(--pick)", "stroke-width": 2.5 }));
  }
  return svg;
}

function heat() {
  byId("sensitivity").hidden = DATA.sensitivity.length === 0;
  const rows = DATA.sensitivity.slice().sort((a, b) => DATA.metrics[b.metric].is_objective - DATA.metrics[a.metric].is_objective);
  const table = byId("heat");
  table.append(element("tr", {}, element("th", {}), ...DATA.axes.map((a) => element("th", { scope: "col" }, a.name))));
  for (const row of rows) {
    const metric = DATA.metrics[row.metric];
    table.append(element("tr", {}, element("th", { scope: "row", title: metric.what }, metric.name + (metric.is_objective ? " *" : "")),
      ...row.cells.map(([share, words]) => {
        if (share === null) return element("td", { className: "none" }, words);
        const percent = 100 * share;
        const ink = share > (matchMedia("(prefers-color-scheme: dark)").matches ? 0 : 0.8) ? "#ffffff" : "var(--ink)";
        return element("td", { style: `background:color-mix(in srgb, #0072b2 ${percent.toFixed(0)}%, var(--paper));color:${ink}` },
          `${digits(Number(percent.toPrecision(3)))} % ${words}`);
      }), element("td", { className: "basis" }, row.basis)));
  }
}

function stallControls() {
  byId("stalls").hidden = ROWS.kinds.length === 0;
  const select = byId("stall-kind");
  ROWS.kinds.forEach((kind, k) => select.append(element("option", { value: k, selected: kind === "icu" }, kind)));
  select.addEventListener("change", drawStalls);
  listeners.rows.push(drawStalls);
  listeners.pick.push(drawStalls);
}

function drawStalls() {
  if (ROWS.kinds.length === 0) return;
  const kind = Number(byId("stall-kind").value);
  const rows = [];
  for (const i of state.shown) {
    if (rows.length === 30) break;
    if (ROWS.stalls[kind][i].length > 0) rows.push(i);
  }
  const parts = [];
  for (const i of rows) {
    const name = element("button", { type: "button", className: i === state.picked ? "picked" : "" }, pointText(i));
    const bar = stallBar(kind, i);
    for (const part of [name, bar]) part.addEventListener("click", () => pick(i));
    bar.style.cursor = "pointer";
    parts.push(name, bar, element("span", {}, `${ROWS.stalls[kind][i][0] / 10} % work`));
  }
  const bars = byId("stall-bars");
  bars.className = "bars";
  bars.replaceChildren(...parts);
  byId("stall-legend").replaceChildren(...causeLegend([kind], rows));
}

function impossible() {
  byId("impossible").hidden = DATA.impossible.length === 0;
  byId("impossible-list").append(...DATA.impossible.map(([reason, n]) => element("li", {}, `${n}: ${reason}`)));
}

head();
curveControls();
heat();
stallControls();
impossible();
arrange();
const bestRow = (() => {
  const column = OBJECTIVES[0];
  if (!column) return COUNT > 0 ? 0 : null;
  let best = null;
  for (let i = 0; i < COUNT; i++) {
    const v = isMeasured(i) ? column.number(i) : null;
    if (v === null) continue;
    if (best === null || (column.goal === "minimise" ? v < column.number(best) : v > column.number(best))) best = i;
  }
  return best;
})();
if (bestRow !== null) pick(bestRow);
else drawCurves();
