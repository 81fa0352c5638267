// A point: command, values, what its board has otherwise than the base, stalls, area, the board file.

(function setUp() {
  listeners.pick.push(showDetail);
})();

function showDetail() {
  const i = state.picked;
  if (i === null) return;
  byId("detail-title").textContent = `Point #${ROWS.point[i]}${isFront(i) ? ", on the front" : ""}`;
  const parts = [element("p", {}, pointText(i).replace(/^#\d+: /, ""))];
  const status = ROWS.status[i];
  if (ERRORS.has(i)) parts.push(element("p", { className: "error" }, `failed: ${ERRORS.get(i)}`));
  else if (status === "pruned") parts.push(element("p", { className: "note" }, "Pruned: its bounds are dominated, it was not run."));
  else if (status === "shortened") parts.push(element("p", { className: "note" }, "Ran on a shortened workload only: not compared."));
  else if (WIDTHS.has(i)) parts.push(element("p", { className: "note" }, `Estimated from a sample: cycles +- ${shown(WIDTHS.get(i), "cycles")} (95 %).`));
  parts.push(copied(commandOf(i)));
  const { lines, base, changed } = boardOf(i);
  parts.push(element("h3", {}, "Differences to the base board"), differences(lines, base, changed));
  parts.push(element("h3", {}, "Values"), values(i));
  stallParts(i).forEach((part) => parts.push(part));
  const area = areas(i);
  if (area) parts.push(element("h3", {}, `Area by block (${ROWS.area_unit})`), area);
  const toml = element("pre", { className: "toml", tabIndex: 0 });
  lines.forEach((line, k) => toml.append(element("span", { className: changed && changed.has(k) ? "changed" : "", style: "display:block" }, line || "\u200b")));
  parts.push(element("details", {}, element("summary", {}, "Board file (TOML)"), toml));
  byId("detail-body").replaceChildren(...parts);
}

/** A command with a button that copies it. */
function copied(text) {
  const button = element("button", { type: "button" }, "Copy");
  const pre = element("pre", { tabIndex: 0 }, text);
  button.addEventListener("click", async () => {
    let done = false;
    try {
      await navigator.clipboard.writeText(text);
      done = true;
    } catch {
      // Without leave, as from some local files: by selection.
      const range = document.createRange();
      range.selectNodeContents(pre);
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      done = document.execCommand("copy");
    }
    button.textContent = done ? "Copied" : "Press Ctrl+C";
    setTimeout(() => (button.textContent = "Copy"), 1500);
  });
  return element("div", { className: "command" }, pre, button);
}

/** Keys of a board file with their dotted names: [name, value] by line. */
function keysOf(lines) {
  let section = "";
  return lines.map((line) => {
    const head = /^\[(.+)\]$/.exec(line.trim());
    if (head) section = `${head[1]}.`;
    const key = /^([\w-]+)\s*=\s*(.*)$/.exec(line.trim());
    return key && !head ? [section + key[1], key[2]] : null;
  });
}

function differences(lines, base, changed) {
  const now = keysOf(lines), before = new Map(keysOf(base).filter(Boolean));
  const rows = now.filter((k) => k && before.get(k[0]) !== k[1]);
  const gone = [...before.keys()].filter((name) => !now.some((k) => k && k[0] === name));
  if (base.length === 0) return element("p", { className: "note" }, "The base is not known.");
  if (rows.length + gone.length === 0) return element("p", { className: "note" }, "None: this is the base.");
  return element("table", {},
    ...rows.map(([name, value]) => element("tr", {}, element("td", {}, name),
      element("td", {}, `${before.has(name) ? before.get(name) : "not given"} \u2192 ${value}`))),
    ...gone.map((name) => element("tr", {}, element("td", {}, name), element("td", {}, `${before.get(name)} \u2192 not given`))));
}

function values(i) {
  const columns = COLUMNS.filter((c) => c.metric !== undefined || ["layer", "limit", "longest path", "status"].includes(c.name));
  return element("table", {}, ...columns.map((c) => element("tr", { title: c.what || "" },
    element("td", {}, c.name + (c.isObjective ? " *" : "")), element("td", {}, c.text(i)))));
}

/** A bar of a kind's cycles by cause. */
function stallBar(kind, i) {
  const shares = ROWS.stalls[kind][i];
  if (shares.length === 0) return null;
  const words = shares.map((s, c) => [s, DATA.causes[c]]).filter(([s]) => s > 0).map(([s, name]) => `${name} ${s / 10} %`).join(", ");
  const bar = element("div", { className: "bar", role: "img", title: words, "aria-label": `${ROWS.kinds[kind]}: ${words}` });
  shares.forEach((s, c) => {
    if (s > 0) bar.append(element("i", { style: `width:${s / 10}%;background:${COLOURS[c]}` }));
  });
  return bar;
}

function causeLegend(kinds, rows) {
  const used = DATA.causes.map((_, c) => kinds.some((k) => rows.some((i) => (ROWS.stalls[k][i][c] || 0) > 0)));
  return DATA.causes.map((name, c) => (used[c]
    ? element("span", {}, element("i", { className: "swatch", style: `background:${COLOURS[c]}` }), name) : null)).filter(Boolean);
}

function stallParts(i) {
  const bars = element("div", { className: "bars" });
  ROWS.kinds.forEach((kind, k) => {
    const bar = stallBar(k, i);
    if (bar) bars.append(element("span", {}, kind), bar, element("span", {}, `${ROWS.stalls[k][i][0] / 10} % work`));
  });
  if (bars.children.length === 0) return [];
  return [element("h3", {}, "Cycles by cause"), bars,
    element("p", { className: "legend" }, ...causeLegend(ROWS.kinds.map((_, k) => k), [i]))];
}

function areas(i) {
  const known = ROWS.blocks.map((name, b) => [name, ROWS.area[b][i]]).filter(([, a]) => a !== null && a > 0);
  if (known.length === 0) return null;
  known.sort((a, b) => b[1] - a[1]);
  const sum = known.reduce((s, [, a]) => s + a, 0);
  const bars = element("div", { className: "bars" });
  for (const [name, a] of known) {
    const bar = element("div", { className: "bar" }, element("i", { style: `width:${(100 * a) / known[0][1]}%;background:var(--front)` }));
    bars.append(element("span", {}, name), bar, element("span", {}, `${digits(a)} (${((100 * a) / sum).toFixed(0)} %)`));
  }
  return bars;
}
