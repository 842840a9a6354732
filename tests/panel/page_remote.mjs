// The page of a machine on another computer, in a real browser: it says so, and moves the machine there.
//
// usage: node page_remote.mjs ORIGIN KEY PAGE_SOURCES OUTPUT_FOLDER
import assert from "node:assert/strict";
import { join } from "node:path";
import { launch } from "./page_browser.mjs";

const [origin, key, sources, output] = process.argv.slice(2);
const { browser, open, part, until, complaints } = await launch(origin, key, sources);
try {
  const page = await open({ width: 1280, height: 800 });
  const said = await until(page, "remote", (text) => text.includes("another computer"), "that the machine is a remote one");
  assert(said.includes("“office”") && said.includes("may operate it"), said);
  assert.equal(await part(page, "upload").count(), 0, "a program of this computer has no way to the machine");
  await part(page, "take").click();
  await until(page, "controls", (text) => text.includes("You have"), "the controls");
  const before = Number(await part(page, "machine-X").textContent());
  await part(page, "jog-X+").click();
  await until(page, "machine-X", (text) => Math.abs(Number(text) - before - 1) < 0.002, `${before} and 1`);
  await page.screenshot({ path: join(output, "remote.png") });
  await page.getByRole("tab", { name: /^Scope/ }).click();
  await until(page, "scope-text", (text) => text.includes("own computer"), "where the scope is");
  assert.deepEqual(complaints.filter((one) => !one.includes("404")), [], "the browser complains");
} finally {
  await browser.close();
}
