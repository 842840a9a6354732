// How many frames a second the page draws of a program's plan while the view turns, at 1280 x 800. It reports; what a
// computer reaches beside its other work is no test.
//
// usage: node page_frames.mjs ORIGIN KEY PAGE_SOURCES OUTPUT_FOLDER PROGRAM...
import assert from "node:assert/strict";
import { join } from "node:path";
import { launch } from "./page_browser.mjs";

const [origin, key, sources, output, ...programs] = process.argv.slice(2);
const kSeconds = 4;
const { browser, open, part, until, complaints } = await launch(origin, key, sources);
try {
  const page = await open({ width: 1280, height: 800 });
  await until(page, "state", (shown) => shown === "Ready", "Ready");
  await part(page, "take").click();
  for (const program of programs) {
    await page.keyboard.press("1");
    await part(page, "load-name").fill(program);
    await part(page, "load").click();
    await until(page, "program", (shown) => shown === program, program);
    await page.getByRole("tab", { name: "Path" }).click();
    await part(page, "plan-time").waitFor();
    for (const what of ["machine", "work"]) {
      await part(page, `fit-${what}`).click();
      const found = await part(page, "scene").evaluate((host, seconds) => host.scene.measure(seconds), kSeconds);
      assert(found.lines > 0, "no line of the plan is drawn");
      console.log(`${program}: ${found.frames.toFixed(1)} frames/s of ${found.lines} lines in the view of the ${what}`);
    }
    await page.screenshot({ path: join(output, `plan_${program}.png`) });
  }
  assert.deepEqual(complaints, [], "the browser complains");
} catch (error) {
  console.error(error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
}
