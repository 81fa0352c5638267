// The scatter plot: any two columns, the front over what it dominates, hover, click, arrow keys.

const scatter = { x: null, y: null, colour: null, px: new Float32Array(COUNT), py: new Float32Array(COUNT), on: [], hover: null };

(function setUp() {
  const [first, second] = [OBJECTIVES[0] || PLOTTED[0], OBJECTIVES[1] || PLOTTED.find((c) => c.isAxis) || PLOTTED[0]];
  scatter.y = first;
  scatter.x = second;
  for (const [id, key] of [["scatter-x", "x"], ["scatter-y", "y"], ["scatter-colour", "colour"]]) {
    const select = byId(id);
    if (key === "colour") select.append(element("option", { value: "" }, "front"));
    for (const [k, column] of PLOTTED.entries()) {
      select.append(element("option", { value: k, selected: scatter[key] === column }, column.name + (column.isObjective ? " *" : "")));
    }
    select.addEventListener("change", () => {
      scatter[key] = select.value === "" ? null : PLOTTED[Number(select.value)];
      if (key !== "colour") byId(`${id}-log`).checked = wantsLog(scatter[key]);
      draw();
    });
    if (key !== "colour") byId(`${id}-log`).checked = wantsLog(scatter[key]);
  }
  for (const id of ["scatter-x-log", "scatter-y-log", "scatter-front"]) byId(id).addEventListener("change", draw);
  const canvas = byId("scatter");
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  canvas.addEventListener("mousemove", (e) => hover(nearest(e), e.offsetX, e.offsetY));
  canvas.addEventListener("mouseleave", () => hover(null));
  canvas.addEventListener("click", (e) => {
    const i = nearest(e);
    if (i !== null) pick(i);
  });
  canvas.addEventListener("keydown", (e) => {
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[e.key];
    if (!step || scatter.on.length === 0) return;
    e.preventDefault();
    const order = scatter.on.slice().sort((a, b) => scatter.px[a] - scatter.px[b] || scatter.py[a] - scatter.py[b] || a - b);
    const at = order.indexOf(state.picked);
    pick(order[at < 0 ? 0 : (at + step + order.length) % order.length]);
  });
  listeners.pick.push(draw);
  listeners.rows.push(draw);
})();

/** Positive numbers over a wide range are read on a logarithmic scale. */
function wantsLog(column) {
  let low = Infinity, high = 0;
  if (!column || column.names) return false;
  for (let i = 0; i < COUNT; i++) {
    const v = column.number(i);
    if (v === null) continue;
    low = Math.min(low, v);
    high = Math.max(high, v);
  }
  return low > 0 && high > 12 * low;
}

function draw() {
  const canvas = byId("scatter");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (width === 0 || !scatter.x) return;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const ctx = canvas.getContext("2d");
  ctx.scale(ratio, ratio);
  const style = getComputedStyle(document.documentElement);
  const css = (name) => style.getPropertyValue(name).trim();
  const [left, right, top, bottom] = [78, width - 14, 12, height - 46];
  const { x, y, colour } = scatter;
  const frontOnly = byId("scatter-front").checked;
  const xLog = byId("scatter-x-log").checked && !x.names, yLog = byId("scatter-y-log").checked && !y.names;
  let lacking = 0;
  const rows = state.shown.filter((i) => {
    const [a, b] = [x.number(i), y.number(i)];
    const has = a !== null && b !== null && !(xLog && a <= 0) && !(yLog && b <= 0);
    lacking += has ? 0 : 1;
    return has && (!frontOnly || isFront(i));
  });
  const xs = scale(rows.map(x.number), xLog, left, right), ys = scale(rows.map(y.number), yLog, bottom, top);
  scatter.on = rows;
  const of = COUNT === state.shown.length ? "" : ` of ${state.shown.length} that the filter leaves`;
  byId("scatter-note").textContent = `${rows.length} points${of}${lacking ? `; ${lacking} have no value here` : ""}.`;
  canvas.setAttribute("aria-label", `${y.name} against ${x.name}, ${rows.length} points. Arrow keys go from point to point.`);
  ctx.font = "12px system-ui, sans-serif";
  if (!xs || !ys) {
    ctx.fillStyle = css("--soft");
    ctx.fillText("No point has both values.", left, (top + bottom) / 2);
    return;
  }
  frame(ctx, css, x, y, xs, ys, [left, right, top, bottom]);
  ctx.save();
  ctx.beginPath();
  ctx.rect(left - 8, top - 8, right - left + 16, bottom - top + 16);
  ctx.clip();
  const ramp = colour ? colours(colour, rows) : null;
  const paint = (i, radius, fill, alpha) => {
    ctx.globalAlpha = alpha;
    ctx.fillStyle = fill;
    ctx.beginPath();
    ctx.arc(scatter.px[i], scatter.py[i], radius, 0, 7);
    ctx.fill();
  };
  for (const i of rows) {
    scatter.px[i] = xs.pixel(x.number(i));
    scatter.py[i] = ys.pixel(y.number(i));
  }
  const dim = rows.length > 2000 ? 0.3 : 0.55;
  const small = rows.length > 2000 ? 2 : 3;
  for (const i of rows) if (!isFront(i)) paint(i, small, ramp ? ramp(i) : css("--dim"), ramp ? 0.8 : dim);
  for (const i of rows) {
    if (!isFront(i)) continue;
    paint(i, 5.5, css("--paper"), 1);
    paint(i, 4.5, ramp ? ramp(i) : css("--front"), 1);
  }
  ctx.globalAlpha = 1;
  for (const [i, name] of [[scatter.hover, "--hover"], [state.picked, "--pick"]]) {
    if (i === null || !rows.includes(i)) continue;
    ctx.strokeStyle = css(name);
    ctx.lineWidth = 2.5;
    ctx.beginPath();
    ctx.arc(scatter.px[i], scatter.py[i], 8, 0, 7);
    ctx.stroke();
  }
  ctx.restore();
  legend(colour, css);
}

function frame(ctx, css, x, y, xs, ys, [left, right, top, bottom]) {
  const text = (words, px, py, align) => {
    ctx.textAlign = align;
    ctx.fillText(words, px, py);
  };
  const label = (column, v) => (column.names ? column.names[v] : column.isAxis ? String(v) : shown(v, column.unit));
  const marks = (column, s, most) => {
    if (column.names) return column.names.map((_, k) => k).filter((k) => k >= s.low && k <= s.high);
    return ticks(s.low, s.high, s.isLog, most);
  };
  ctx.lineWidth = 1;
  let last = -Infinity;
  for (const v of marks(x, xs, Math.max(3, (right - left) / 90))) {
    const px = Math.round(xs.pixel(v)) + 0.5;
    if (px < left - 1 || px > right + 1) continue;
    ctx.strokeStyle = css("--grid");
    ctx.beginPath();
    ctx.moveTo(px, top);
    ctx.lineTo(px, bottom);
    ctx.stroke();
    ctx.fillStyle = css("--ink");
    const words = label(x, v);
    const wide = ctx.measureText(words).width;
    if (px - wide / 2 > last + 8) {
      text(words, px, bottom + 16, "center");
      last = px + wide / 2;
    }
  }
  last = Infinity;
  for (const v of marks(y, ys, 7)) {
    const py = Math.round(ys.pixel(v)) + 0.5;
    if (py < top - 1 || py > bottom + 1) continue;
    ctx.strokeStyle = css("--grid");
    ctx.beginPath();
    ctx.moveTo(left, py);
    ctx.lineTo(right, py);
    ctx.stroke();
    ctx.fillStyle = css("--ink");
    if (last - py > 13) {
      text(label(y, v), left - 7, py + 4, "right");
      last = py;
    }
  }
  ctx.strokeStyle = css("--soft");
  ctx.strokeRect(left + 0.5, top + 0.5, right - left, bottom - top);
  ctx.fillStyle = css("--soft");
  const better = (c) => (c.goal ? (c.goal === "minimise" ? ", less is better" : ", more is better") : "");
  text(x.name + better(x), (left + right) / 2, bottom + 36, "center");
  ctx.save();
  ctx.translate(12, (top + bottom) / 2);
  ctx.rotate(-Math.PI / 2);
  text(y.name + better(y), 0, 0, "center");
  ctx.restore();
}

/** Row to colour: from dark violet through green to yellow, or one of a few of words. */
function colours(column, rows) {
  if (column.names) return (i) => COLOURS[column.number(i) % COLOURS.length];
  const stops = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  const s = scale(rows.map(column.number), wantsLog(column), 0, 1);
  return (i) => {
    const v = column.number(i);
    if (v === null || !s) return "#888888";
    const t = Math.min(0.9999, Math.max(0, s.pixel(v))) * 4;
    const [a, b] = [stops[Math.floor(t)], stops[Math.floor(t) + 1]];
    return `rgb(${a.map((c, k) => Math.round(c + (b[k] - c) * (t % 1))).join(",")})`;
  };
}

function legend(column, css) {
  const entries = [];
  const entry = (colour, words) => entries.push(element("span", {}, element("i", { className: "swatch", style: `background:${colour}` }), words));
  if (!column) {
    entry(css("--front"), "front");
    entry(css("--dim"), "dominated or not compared");
  } else if (column.names) {
    column.names.forEach((name, k) => entry(COLOURS[k % COLOURS.length], `${column.name} = ${name}`));
  } else {
    entries.push(element("span", {}, element("i", { className: "swatch",
      style: "width:120px;background:linear-gradient(90deg,rgb(68,1,84),rgb(59,82,139),rgb(33,145,140),rgb(94,201,98),rgb(253,231,37))" }),
      `${column.name}, low to high${wantsLog(column) ? " (log)" : ""}; large: front`));
  }
  entry(css("--pick"), "picked");
  byId("scatter-legend").replaceChildren(...entries);
}

/** The row whose dot is next to the mouse, of equal ones that of the front; null when none is near. */
function nearest(e) {
  let best = null, distance = 14 * 14;
  for (const i of scatter.on) {
    const d = (scatter.px[i] - e.offsetX) ** 2 + (scatter.py[i] - e.offsetY) ** 2 - (isFront(i) ? 4 : 0);
    if (d < distance) [best, distance] = [i, d];
  }
  return best;
}

function hover(i, px, py) {
  const tip = byId("tip");
  if (i !== scatter.hover) {
    scatter.hover = i;
    draw();
    if (i !== null) {
      const columns = COLUMNS.filter((c) => c.isAxis || c.isObjective || c === scatter.x || c === scatter.y || c === scatter.colour);
      const row = (name, value) => element("tr", {}, element("td", {}, name), element("td", {}, value));
      tip.replaceChildren(element("table", {}, row("point", `#${ROWS.point[i]}${isFront(i) ? ", on the front" : ""}`),
        ...columns.map((c) => row(c.name, c.text(i))), row("limit", COLUMNS.find((c) => c.name === "limit").text(i))));
    }
  }
  tip.hidden = i === null;
  if (i === null) return;
  const box = byId("scatter-box");
  tip.style.left = `${px + 16 + tip.offsetWidth > box.clientWidth ? Math.max(0, px - 16 - tip.offsetWidth) : px + 16}px`;
  tip.style.top = `${Math.max(0, Math.min(py + 12, box.clientHeight - tip.offsetHeight))}px`;
}
