// Opens the page, goes from view to view as an operator does, and notes what the page's own memory holds: bytes of the
// heap and elements, behind a collection of what nobody needs. Prints a line of JSON for each round, for page_memory.py.
//
// usage: node page_memory.mjs ORIGIN KEY PAGE_SOURCES SECONDS
import assert from "node:assert/strict";
import { launch } from "./page_browser.mjs";

const kViews = ["Run", "Path", "Scope", "Machine", "Offsets and tools", "Alarms", "All machines"];
const kViewMs = 1500;

const [origin, key, sources, seconds] = process.argv.slice(2);
const { browser, open, until, complaints } = await launch(origin, key, sources);
const rest = (ms) => new Promise((done) => setTimeout(done, ms));
try {
  const page = await open({ width: 1280, height: 800 });
  await until(page, "state", (shown) => shown && shown !== "No daemon", "a state");
  const tools = await page.context().newCDPSession(page);
  await tools.send("Performance.enable");
  const begin = Date.now();
  while (Date.now() < begin + 1000 * Number(seconds)) {
    for (const name of kViews) {
      await page.getByRole("tab", { name: new RegExp(`^${name}`) }).click();
      await rest(kViewMs);
    }
    await page.getByRole("tab", { name: /^Run/ }).click();
    await rest(kViewMs);
    for (let i = 0; i < 3; ++i) await tools.send("HeapProfiler.collectGarbage");
    const found = Object.fromEntries((await tools.send("Performance.getMetrics")).metrics.map(({ name, value }) => [name, value]));
    console.log(JSON.stringify({ s: (Date.now() - begin) / 1000, heap: found.JSHeapUsedSize, nodes: found.Nodes, listeners: found.JSEventListeners }));
  }
  assert.deepEqual(complaints, []);
} finally {
  await browser.close();
}
