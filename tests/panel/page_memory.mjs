// Opens the page, goes from view to view as an operator does, and notes what the page's own memory holds: bytes of the
// heap and elements, behind a collection of what nobody needs. Prints a line of JSON for each round, for page_memory.py.
//
// usage: node page_memory.mjs ORIGIN KEY PAGE_SOURCES SECONDS
import assert from "node:assert/strict";
import { launch } from "./page_browser.mjs";

const kViews = ["Run", "Path", "Scope", "Machine", "Offsets and tools", "Alarms", "All machines"];
const kViewMs = 1500;
const kVisits = 20;  // of the 3-D view, one after the other

const [origin, key, sources, seconds] = process.argv.slice(2);
const { browser, open, until, complaints } = await launch(origin, key, sources);
const rest = (ms) => new Promise((done) => setTimeout(done, ms));
try {
  const page = await open({ width: 1280, height: 800 });
  await until(page, "state", (shown) => shown && shown !== "No daemon", "a state");
  const tools = await page.context().newCDPSession(page);
  await tools.send("Performance.enable");
  const view = (name) => page.getByRole("tab", { name: new RegExp(`^${name}`) }).click();
  const look = async () => {
    for (let i = 0; i < 3; ++i) await tools.send("HeapProfiler.collectGarbage");
    const { metrics } = await tools.send("Performance.getMetrics");
    const found = Object.fromEntries(metrics.map(({ name, value }) => [name, value]));
    return { heap: found.JSHeapUsedSize, nodes: found.Nodes, listeners: found.JSEventListeners };
  };
  const visit = async () => {
    await view("Path");
    await rest(200);
    await view("Run");
    await rest(100);
  };
  // Also those that stand in no document any more.
  const canvases = async () => {
    const { result } = await tools.send("Runtime.evaluate", { expression: "HTMLCanvasElement.prototype" });
    const { objects } = await tools.send("Runtime.queryObjects", { prototypeObjectId: result.objectId });
    const { result: count } = await tools.send("Runtime.callFunctionOn", {
      objectId: objects.objectId, functionDeclaration: "function () { return this.length; }", returnByValue: true });
    await tools.send("Runtime.releaseObject", { objectId: objects.objectId });
    return count.value;
  };
  await visit();
  const before = await canvases();
  for (let i = 0; i < kVisits; ++i) await visit();
  console.log(JSON.stringify({ visits: kVisits, canvases: (await canvases()) - before }));
  const begin = Date.now();
  while (Date.now() < begin + 1000 * Number(seconds)) {
    for (const name of kViews) {
      await view(name);
      await rest(kViewMs);
    }
    await view("Run");
    await rest(kViewMs);
    console.log(JSON.stringify({ s: (Date.now() - begin) / 1000, ...(await look()) }));
  }
  assert.deepEqual(complaints, []);
} finally {
  await browser.close();
}
