// The path that 'trunnion run --report' draws works from a file: nothing is asked for, and it tells what the run told.
//
// usage: node page_report.mjs PATH_HTML PAGE_SOURCES OUTPUT_FOLDER CYCLE_TIME_S TIP_DEVIATION_MM
import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [file, sources, output, cycle, deviation] = process.argv.slice(2);
const { chromium } = createRequire(join(sources, "package.json"))("playwright-core");
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const complaints = [];
try {
  for (const [name, size, colorScheme] of [["dark", { width: 1280, height: 800 }, "dark"], ["light", { width: 820, height: 1180 }, "light"]]) {
    const page = await (await browser.newContext({ viewport: size, colorScheme })).newPage();
    page.on("pageerror", (error) => complaints.push(String(error.stack)));
    page.on("request", (request) => request.url() !== pathToFileURL(file).href && complaints.push(`asked ${request.url()}`));
    await page.goto(pathToFileURL(file).href);
    const clock = await page.locator('[data-test="plan-time"]').textContent();
    const [minutes, seconds] = clock.split(":").map(Number);
    assert(Math.abs(60 * minutes + seconds - Number(cycle)) < 2, `${clock} instead of ${cycle} s`);
    await page.locator('[data-test="colour-deviation"]').click();
    const [, most] = /([\d.]+) µm/.exec(await page.locator(".ramp").textContent());
    // The plan's points are fewer than the run's periods.
    assert(most <= 1000 * deviation + 0.06 && most > 800 * deviation, `${most} µm instead of ${1000 * deviation}`);
    await page.locator('[data-test="fit-machine"]').click();
    const colours = await page.locator('[data-test="scene"]').evaluate(async (host) => host.scene.colours());
    assert(colours > 20, `the machine and its path are drawn in ${colours} colours`);
    await page.locator('[data-test="fit-work"]').click();
    await page.screenshot({ path: join(output, `report_${name}.png`) });
  }
  assert.deepEqual(complaints, []);
  console.log("the report needs no server");
} catch (error) {
  console.error(error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
}
