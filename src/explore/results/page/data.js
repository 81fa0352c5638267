// The data, its columns, and numbers in words.

const DATA = JSON.parse(document.getElementById("data").textContent);
const ROWS = DATA.rows;
const COUNT = ROWS.point.length;
const ERRORS = new Map(ROWS.errors);
const WIDTHS = new Map(ROWS.half_width_cycles);
const byId = (id) => document.getElementById(id);

/** An element with properties and children; texts are never HTML. */
function element(name, properties, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties || {})) {
    if (key === "style" || key.includes("-") || key === "role") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children.filter((c) => c !== null && c !== undefined));
  return made;
}

/** Four significant digits, in fixed notation where that is readable. */
function digits(value) {
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size >= 999.5 && size < 1e7) return value.toFixed(0);
  if (size >= 0.001 && size < 999.5) return String(Number(value.toPrecision(4)));
  return value.toExponential(3).replace("e+", "e");
}

const PREFIXES = [[1e12, "T"], [1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "u"], [1e-9, "n"]];

/** A value with its unit, with an SI prefix where the unit takes one. */
function shown(value, unit) {
  if (value === null || value === undefined) return "-";
  if (unit === "") return digits(value);
  const per = unit.startsWith("1/");
  if (!per && !["s", "W", "J", "cycles", "gates", "bits", "LUTs"].includes(unit)) return `${digits(value)} ${unit}`;
  const [scale, prefix] = PREFIXES.find(([s]) => Math.abs(value) * 1.0005 >= s) || [1, ""];
  return `${Number((value / scale).toPrecision(3))} ${prefix}${per ? unit.slice(1) : unit}`;
}

/**
 * A column: `number(i)` places row i along a scale (null: it has none), `text(i)` says it.
 * Of an axis of words the place is that in the axis, and `names` are its ticks.
 */
const COLUMNS = [{ name: "point", unit: "", number: (i) => ROWS.point[i], text: (i) => `#${ROWS.point[i]}` }];
COLUMNS.push({ name: "status", unit: "", isText: true, number: () => null, text: (i) => ROWS.status[i] });
DATA.axes.forEach((axis, a) => {
  const places = ROWS.values[a];
  const isText = axis.values.some((v) => typeof v !== "number");
  COLUMNS.push({
    name: axis.name, unit: "", isAxis: true, isText, plots: true, names: isText ? axis.values.map(String) : null,
    number: (i) => (places[i] < 0 ? null : isText ? places[i] : axis.values[places[i]]),
    text: (i) => (places[i] < 0 ? "-" : String(axis.values[places[i]])),
  });
});
const goalsFirst = DATA.metrics.map((_, m) => m).sort((a, b) => DATA.metrics[b].is_objective - DATA.metrics[a].is_objective || a - b);
goalsFirst.forEach((m) => {
  const metric = DATA.metrics[m];
  const values = ROWS.metrics[m];
  COLUMNS.push({
    name: metric.name, unit: metric.unit, what: metric.what, goal: metric.goal, isObjective: metric.is_objective,
    metric: m, plots: true, number: (i) => values[i], text: (i) => shown(values[i], metric.unit),
  });
});
COLUMNS.push({ name: "layer", unit: "", what: "0: on the front, 1: on the front of the rest", number: (i) => ROWS.rank[i],
  text: (i) => (ROWS.rank[i] === null ? "-" : String(ROWS.rank[i])) });
COLUMNS.push({ name: "limit", unit: "", isText: true, number: () => null,
  text: (i) => (ROWS.limit[i] ? `${ROWS.limit[i][0]} ${digits(100 * ROWS.limit[i][1])} %` : "-") });
COLUMNS.push({ name: "longest path", unit: "", isText: true, number: () => null, text: (i) => ROWS.block[i] || "-" });

const PLOTTED = COLUMNS.filter((c) => c.plots);
const OBJECTIVES = COLUMNS.filter((c) => c.isObjective);
const isMeasured = (i) => ROWS.status[i] === "simulated" || ROWS.status[i] === "sampled";
const isFront = (i) => ROWS.rank[i] === 0;

/** The point and the values of its axes. */
function pointText(i) {
  return `#${ROWS.point[i]}: ` + COLUMNS.filter((c) => c.isAxis).map((c) => `${c.name} = ${c.text(i)}`).join(", ");
}

/** The lines of a row's board, and which of them the base has otherwise. */
function boardOf(i) {
  const board = ROWS.board[i];
  const base = DATA.base === "" ? [] : DATA.base.replace(/\n$/, "").split("\n");
  if (typeof board === "string") return { lines: board.replace(/\n$/, "").split("\n"), base, changed: null };
  const lines = base.slice();
  const changed = new Set();
  for (const [at, text] of board) {
    lines[at] = text;
    changed.add(at);
  }
  return { lines, base, changed };
}

const commandOf = (i) => ROWS.command[0] + ROWS.command[2][i] + ROWS.command[1];

/** Colours that stay apart for colour-blind readers (Okabe, Ito 2008); beyond them, paler ones. */
const COLOURS = ["#009e73", "#d55e00", "#0072b2", "#cc79a7", "#e69f00", "#56b4e9", "#eaaf80", "#9aa0a8", "#f2cf80", "#abdaf4"];
const OPTIMA = ["#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#0072b2"];

/** What the parts tell each other: the picked row, and the rows that the filter leaves, as sorted. */
const state = { picked: null, shown: [], visible: new Uint8Array(COUNT) };
const listeners = { pick: [], rows: [] };
const tell = (what) => listeners[what].forEach((f) => f());

function pick(i) {
  state.picked = i;
  tell("pick");
}

/** Round values within a range; of a logarithmic scale powers of ten and their parts. */
function ticks(low, high, isLog, most) {
  if (isLog) {
    const decades = Math.log10(high / low);
    const parts = decades > 3 ? [1] : decades > 1.2 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 7];
    const made = [];
    for (let k = Math.floor(Math.log10(low)); k <= Math.ceil(Math.log10(high)); k++) {
      for (const p of parts) if (p * 10 ** k >= low && p * 10 ** k <= high) made.push(Number((p * 10 ** k).toPrecision(3)));
    }
    return made;
  }
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough * 0.999) || rough;
  const made = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) made.push(Number((k * step).toPrecision(12)));
  return made;
}

/** A scale: values to pixels. Null where there is nothing to scale. */
function scale(values, isLog, from, to, fromZero) {
  let low = Infinity, high = -Infinity;
  for (const v of values) {
    if (v === null || v === undefined || (isLog && v <= 0)) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  if (low > high) return null;
  if (fromZero && !isLog) { low = Math.min(0, low); high = Math.max(0, high); }
  const f = isLog ? Math.log10 : (v) => v;
  let a = f(low), b = f(high);
  const room = b > a ? 0.05 * (b - a) : Math.max(Math.abs(a) * 0.1, 0.5);
  if (!(fromZero && low === 0)) a -= room;
  b += room;
  const g = isLog ? (v) => 10 ** v : (v) => v;
  return { low: g(a), high: g(b), isLog, pixel: (v) => from + ((f(v) - a) / (b - a)) * (to - from) };
}
