// The page of one machine: the machine is drawn and, behind a daemon, stands where its joints are.
//
// usage: node page_machines.mjs ORIGIN KEY PAGE_SOURCES PICTURE live|alone
import assert from "node:assert/strict";
import { launch } from "./page_browser.mjs";

const [origin, key, sources, picture, how] = process.argv.slice(2);
const { browser, open, part, until, complaints } = await launch(origin, key, sources);
try {
  const page = await open({ width: 1280, height: 800 });
  const wanted = how === "live" ? "Ready" : "No machine";
  await until(page, "state", (shown) => shown === wanted, wanted);
  await page.keyboard.press("2");
  await part(page, "scene").locator("canvas").waitFor();
  await part(page, "fit-machine").click();
  // A picture of the background alone has one colour.
  const colours = await part(page, "scene").evaluate(async (host) => host.scene.colours());
  assert(colours > 20, `the machine is drawn in ${colours} colours only`);
  await page.screenshot({ path: picture });
  assert.deepEqual(complaints, [], "the browser complains");
} catch (error) {
  console.error(picture, error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
}
