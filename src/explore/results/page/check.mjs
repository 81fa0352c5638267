// Opens a page of results in headless Chromium and uses it as a reader would: sorts, filters, hovers, clicks, types.
//
//   node check.mjs page.html [folder for screenshots]        exit status 1 and the fault where something is wrong
//
// No package: Chromium is spoken to over a pipe (DevTools protocol). CHROMIUM names another binary.

import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import { resolve } from "node:path";

const [page, shots] = process.argv.slice(2);
const browser = spawn(process.env.CHROMIUM || "chromium", ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
  "--remote-debugging-pipe", "--window-size=1400,1000", "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
browser.on("error", (e) => fail(`the browser does not start: ${e.message}`));

const waiting = new Map();
const errors = [];
let last = 0, text = "";
browser.stdio[4].on("data", (bytes) => {
  text += bytes;
  const parts = text.split("\0");
  text = parts.pop();
  for (const message of parts.map((p) => JSON.parse(p))) {
    if (message.id) waiting.get(message.id)(message);
    if (message.method === "Runtime.exceptionThrown") errors.push(message.params.exceptionDetails.exception?.description || "an exception");
    if (message.method === "Network.requestWillBeSent" && !/^(file|data|about):/.test(message.params.request.url)) errors.push(`fetches ${message.params.request.url}`);
  }
});

function fail(what) {
  console.error(what);
  browser.kill();
  process.exit(1);
}

function send(method, params = {}, sessionId = session) {
  const id = ++last;
  browser.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
  return new Promise((done) => waiting.set(id, done)).then((m) => (m.error ? fail(`${method}: ${m.error.message}`) : m.result));
}

async function run(code) {
  const { result, exceptionDetails } = await send("Runtime.evaluate", { expression: code, returnByValue: true, awaitPromise: true });
  if (exceptionDetails) fail(`${code}: ${exceptionDetails.exception?.description}`);
  return result.value;
}

const check = (holds, what) => (holds ? null : fail(`wrong: ${what}`));
const settle = () => run("new Promise((done) => setTimeout(() => requestAnimationFrame(() => done(0)), 250))");
async function shot(name, full = false) {
  if (!shots) return;
  const { data } = await send("Page.captureScreenshot", { format: "png", captureBeyondViewport: full });
  writeFileSync(`${shots}/${name}.png`, Buffer.from(data, "base64"));
}
async function key(name) {
  for (const type of ["keyDown", "keyUp"]) await send("Input.dispatchKeyEvent", { type, key: name, code: name });
}

let session;
setTimeout(() => fail("no answer within 100 s"), 100000).unref();
const { targetInfos } = await send("Target.getTargets");
session = (await send("Target.attachToTarget", { targetId: targetInfos.find((t) => t.type === "page").targetId, flatten: true })).sessionId;
for (const domain of ["Page", "Runtime", "Network"]) await send(`${domain}.enable`);
const began = Date.now();
await send("Page.navigate", { url: `file://${resolve(page)}` });
while (!(await run("document.readyState === 'complete' && typeof bestRow !== 'undefined'"))) {
  if (errors.length > 0) fail(errors.join("\n"));
}
await settle();
const loaded = Date.now() - began;
const rows = await run("COUNT");
check((await run("document.querySelectorAll('#table tbody tr[data-row]').length")) > 0, "no rows in the table");
check((await run("document.querySelectorAll('#table tbody tr').length")) < 80, "the table holds rows out of sight");
check(await run("byId('table-box').scrollHeight >= COUNT * ROW_HEIGHT"), "the table is not as high as its rows");
check((await run("document.documentElement.scrollWidth <= innerWidth")), "the page is wider than its window");
await shot("light");
await shot("light-full", true);

// The picked row is the best of the first objective; its command, differences and bars are there.
check((await run("byId('detail-title').textContent")).startsWith("Point #"), "no point is picked at first");
check((await run("document.querySelector('#detail .command pre').textContent")).length > 0, "no command");

// A click on a dot picks it; hovering tells its values.
const dot = await run(`(() => { const i = scatter.on.find((i) => isFront(i) && i !== state.picked) ?? scatter.on[0];
  const box = byId("scatter").getBoundingClientRect();
  return { i, x: box.x + scatter.px[i], y: box.y + scatter.py[i] }; })()`);
await send("Input.dispatchMouseEvent", { type: "mouseMoved", x: dot.x, y: dot.y });
await settle();
check(!(await run("byId('tip').hidden")), "no tip");
check((await run("byId('tip').textContent")).includes(await run("`#${ROWS.point[scatter.hover]}`")), "the tip is of another point");
await shot("hover");
const over = await run("scatter.hover");
const from = Date.now();
for (const type of ["mousePressed", "mouseReleased"]) await send("Input.dispatchMouseEvent", { type, x: dot.x, y: dot.y, button: "left", clickCount: 1 });
check((await run("state.picked")) === over, "a click picks another point");
const clicked = Date.now() - from;
check((await run("byId('detail-title').textContent")).startsWith(`Point #${await run("ROWS.point[state.picked]")}`), "the detail is of another point");

// The board that is shown is the base with the lines that differ, and each difference is named.
check(await run("document.querySelectorAll('#detail .toml .changed').length === ROWS.board[state.picked].length"), "changed lines");
check(await run("document.querySelectorAll('#detail table')[0].rows.length > 0 || ROWS.board[state.picked].length === 0"), "no difference is named");

// Sorting, both ways.
const sorted = (way) => run(`(() => { const c = table.sort; const v = state.shown.map(c.number).filter((x) => x !== null);
  return v.every((x, k) => k === 0 || (${way} ? x <= v[k - 1] : x >= v[k - 1])); })()`);
await run("document.querySelectorAll('#table th button')[COLUMNS.findIndex((c) => c.goal === 'minimise')].click()");
check(await sorted(false), "rising order");
await run("document.querySelectorAll('#table th button')[COLUMNS.findIndex((c) => c.goal === 'minimise')].click()");
check(await sorted(true), "falling order");
check((await run("document.querySelectorAll('#table th[aria-sort=descending]').length")) === 1, "aria-sort");

// Filtering: the front alone, a comparison, a fault.
const filter = async (words) => {
  await run(`byId("filter").value = ${JSON.stringify(words)}; byId("filter").dispatchEvent(new Event("input"))`);
  await settle();
  return run("state.shown.length");
};
check((await filter("front")) === (await run("ROWS.rank.filter((r) => r === 0).length")), "rows of the front");
await shot("front");
const axis = await run("COLUMNS.find((c) => c.isAxis && !c.names)?.name");
if (axis) {
  const middle = await run(`COLUMNS.find((c) => c.name === "${axis}").number(Math.floor(COUNT / 2))`);
  check((await filter(`${axis}>=${middle}`)) === (await run(`ROWS.point.filter((_, i) => COLUMNS.find((c) => c.name === "${axis}").number(i) >= ${middle}).length`)), "rows of a comparison");
}
await filter("nothing>1");
check((await run("byId('filter-note').className")) === "error", "an unknown column is no fault");
check((await filter("")) === rows, "all rows");

// By keyboard: down in the table, Enter; right in the plot.
await run("byId('table-box').focus(); byId('table-box').scrollTop = 0; table.active = 0");
for (const name of ["End", "Home", "ArrowDown", "ArrowDown", "Enter"]) await key(name);
check((await run("state.picked === state.shown[2]")), "Enter picks the third row");
const before = await run("state.picked");
await run("byId('scatter').focus()");
await key("ArrowRight");
check((await run("state.picked")) !== before, "the arrow goes to another point");

// The end of a long table is there.
await run("byId('table-box').scrollTop = 1e9");
await settle();
check(await run("[...document.querySelectorAll('#table tbody tr[data-row]')].at(-1).dataset.row == state.shown.at(-1)"), "the last row");

// Other axes of the plot, logarithmic.
await run("byId('scatter-x').value = 0; byId('scatter-x').dispatchEvent(new Event('change')); byId('scatter-colour').value = 0; byId('scatter-colour').dispatchEvent(new Event('change'))");
await shot("other-axes");

// Copy.
await send("Browser.grantPermissions", { permissions: ["clipboardReadWrite", "clipboardSanitizedWrite"] }, undefined);
await run("document.querySelector('#detail .command button').click()");
await settle();
check((await run("document.querySelector('#detail .command button').textContent")) === "Copied", "Copy does not say so");

await send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: "dark" }] });
await settle();
await run("scrollTo(0, 0)");
await shot("dark-full", true);
await send("Emulation.setDeviceMetricsOverride", { width: 420, height: 900, deviceScaleFactor: 1, mobile: true });
await settle();
check((await run("document.documentElement.scrollWidth <= innerWidth")), "the page is wider than a phone");
await shot("narrow");

if (errors.length > 0) fail(errors.join("\n"));
console.log(`${rows} rows: loaded in ${loaded} ms, a click took ${clicked} ms`);
browser.kill();
process.exit(0);
