// The table: sorted by a header, filtered by words and comparisons; only the rows in sight are in the document.

const ROW_HEIGHT = 26;
const table = { sort: null, down: false, active: 0 };

(function setUp() {
  const head = element("tr", {});
  for (const column of COLUMNS) {
    const button = element("button", { type: "button", title: column.what || "" },
      column.name + (column.isObjective ? " *" : ""), element("small", {}, column.unit));
    button.addEventListener("click", () => sortBy(column));
    head.append(element("th", { scope: "col", className: column.isText ? "text" : "" }, button));
  }
  byId("table").tHead.append(head);
  byId("table").setAttribute("aria-rowcount", COUNT + 1);
  const box = byId("table-box");
  box.addEventListener("scroll", paintRows);
  new ResizeObserver(paintRows).observe(box);
  box.addEventListener("keydown", (e) => {
    const page = Math.max(1, Math.floor(box.clientHeight / ROW_HEIGHT) - 2);
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity }[e.key];
    if (step !== undefined && e.target === box) {
      e.preventDefault();
      table.active = Math.max(0, Math.min(state.shown.length - 1, table.active + step));
      intoSight();
      paintRows();
    } else if (e.key === "Enter" && e.target === box && state.shown.length > 0) {
      pick(state.shown[table.active]);
    }
  });
  byId("table").tBodies[0].addEventListener("click", (e) => {
    const row = e.target.closest("tr[data-row]");
    if (row) pick(Number(row.dataset.row));
  });
  let waiting = null;
  byId("filter").addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = setTimeout(arrange, COUNT > 2000 ? 150 : 0);
  });
  listeners.pick.push(() => {
    const at = state.shown.indexOf(state.picked);
    if (at >= 0) {
      table.active = at;
      intoSight();
    }
    paintRows();
  });
})();

/** A new column falls when more is better, else it rises; the same again the other way. */
function sortBy(column) {
  if (table.sort === column) table.down = !table.down;
  else [table.sort, table.down] = [column, column.goal === "maximise"];
  arrange();
  byId("table-box").scrollTop = 0;
}

/** Filters and sorts; equal rows stay in the order of their points, rows without a value come last. */
function arrange() {
  const { keep, fault } = filterOf(byId("filter").value);
  const shownRows = [];
  for (let i = 0; i < COUNT; i++) {
    state.visible[i] = keep(i) ? 1 : 0;
    if (state.visible[i]) shownRows.push(i);
  }
  const column = table.sort;
  if (column) {
    const way = table.down ? -1 : 1;
    const value = (i) => (column.isText ? column.text(i) : column.number(i));
    const keys = new Map(shownRows.map((i) => [i, value(i)]));
    shownRows.sort((a, b) => {
      const [x, y] = [keys.get(a), keys.get(b)];
      if (x === null || y === null) return (x === null) - (y === null) || a - b;
      return (x < y ? -way : x > y ? way : 0) || a - b;
    });
  }
  state.shown = shownRows;
  table.active = Math.max(0, shownRows.indexOf(state.picked));
  byId("filter-note").textContent = fault || `${shownRows.length} of ${COUNT}`;
  byId("filter-note").className = fault ? "error" : "note";
  COLUMNS.forEach((c, k) => byId("table").tHead.rows[0].cells[k].setAttribute("aria-sort",
    c !== column ? "none" : table.down ? "descending" : "ascending"));
  COLUMNS.forEach((c, k) => {
    const small = byId("table").tHead.rows[0].cells[k].querySelector("small");
    small.textContent = `${c.unit} ${c === column ? (table.down ? "\u25bc" : "\u25b2") : ""}`.trim();
  });
  paintRows();
  tell("rows");
}

/** What a filter keeps: every part must hold. */
function filterOf(text) {
  const parts = text.trim().split(/\s+/).filter((p) => p !== "");
  const tests = [];
  for (const part of parts) {
    const match = /^(.+?)(<=|>=|!=|=|<|>)(.+)$/.exec(part);
    if (!match) {
      const word = part.toLowerCase();
      if (word === "front") tests.push(isFront);
      else tests.push((i) => ROWS.status[i] === word || COLUMNS.some((c) => c.isText && c.text(i).toLowerCase().includes(word))
        || (ERRORS.get(i) || "").toLowerCase().includes(word));
      continue;
    }
    const [, name, how, wanted] = match;
    const column = COLUMNS.find((c) => c.name === name);
    if (!column) return { keep: () => true, fault: `there is no column '${name}'` };
    const number = Number(wanted);
    if (column.isText || column.names) {
      if (how !== "=" && how !== "!=") return { keep: () => true, fault: `'${name}' holds words: use = or !=` };
      tests.push((i) => (column.text(i) === wanted) === (how === "="));
    } else if (Number.isNaN(number)) {
      return { keep: () => true, fault: `'${wanted}' is no number` };
    } else {
      const holds = { "<": (v) => v < number, ">": (v) => v > number, "<=": (v) => v <= number, ">=": (v) => v >= number,
        "=": (v) => v === number, "!=": (v) => v !== number }[how];
      tests.push((i) => column.number(i) !== null && holds(column.number(i)));
    }
  }
  return { keep: (i) => tests.every((t) => t(i)), fault: null };
}

/** Moves the active row into the part of the table that is seen. */
function intoSight() {
  const box = byId("table-box");
  const head = byId("table").tHead.offsetHeight;
  const top = table.active * ROW_HEIGHT;
  if (top < box.scrollTop) box.scrollTop = top;
  else if (top + ROW_HEIGHT + head > box.scrollTop + box.clientHeight) box.scrollTop = top + ROW_HEIGHT + head - box.clientHeight;
}

function paintRows() {
  const box = byId("table-box");
  const n = state.shown.length;
  const from = Math.max(0, Math.floor(box.scrollTop / ROW_HEIGHT) - 5);
  const to = Math.min(n, from + Math.ceil(box.clientHeight / ROW_HEIGHT) + 12);
  const space = (rows) => element("tr", { className: "space", "aria-hidden": "true" },
    element("td", { colSpan: COLUMNS.length, style: `height:${rows * ROW_HEIGHT}px` }));
  const rows = [space(from)];
  for (let k = from; k < to; k++) {
    const i = state.shown[k];
    const names = [isFront(i) ? "front" : "dominated"];
    if (k === table.active) names.push("active");
    if (i === state.picked) names.push("picked");
    const row = element("tr", { className: names.join(" "), "aria-rowindex": k + 2, "aria-selected": String(i === state.picked),
      id: `row-${i}` }, ...COLUMNS.map((c) => element("td", { className: c.isText ? "text" : "" }, c.text(i))));
    row.dataset.row = i;
    rows.push(row);
  }
  rows.push(space(n - to));
  byId("table").tBodies[0].replaceChildren(...rows);
  if (n > 0) box.setAttribute("aria-activedescendant", `row-${state.shown[table.active]}`);
}
