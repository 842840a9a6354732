// The scope of the page: what it caught at a trigger is what 'trunnion scope' caught at the same one, value by value; and
// its frequencies are those of signals that are known. Pictures go into the output folder.
//
// usage: node page_scope.mjs ORIGIN KEY PAGE_SOURCES OUTPUT_FOLDER TRUNNION CONFIG
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { launch } from "./page_browser.mjs";

const [origin, key, sources, output, trunnion, config] = process.argv.slice(2);
const { browser, open, part, until, complaints } = await launch(origin, key, sources);
const folder = mkdtempSync(join(tmpdir(), "scope-"));
const picture = (page, name) => page.screenshot({ path: join(output, `${name}.png`) });
const rest = (ms) => new Promise((done) => setTimeout(done, ms));

/** The page's own functions, without a page. */
async function functions() {
  const { buildSync } = createRequire(join(sources, "package.json"))("esbuild");
  const file = join(folder, "scope_data.mjs");
  buildSync({ entryPoints: [join(sources, "src/scope_data.ts")], bundle: true, format: "esm", outfile: file });
  return import(pathToFileURL(file).href);
}

function checkFunctions({ crossing, ScopeRows, spectrum }) {
  const n = 2048, periodS = 0.001, bin = 1 / (n * periodS);
  const wave = (hz, amplitude) => Array.from({ length: n }, (_, i) => amplitude * Math.sin(2 * Math.PI * hz * i * periodS));
  for (const [k, amplitude] of [[100, 3], [333, 0.02]]) {
    const { frequency, amplitude: found } = spectrum(wave(k * bin, amplitude).map((value) => value + 7), periodS);
    const peak = found.indexOf(Math.max(...found));
    assert(Math.abs(frequency[peak] - k * bin) < 1e-9, `${frequency[peak]} Hz`);
    assert(Math.abs(found[peak] - amplitude) < 1e-6 * amplitude, `${found[peak]}`);
  }
  // Between two lines the window takes 15 % at most off the peak.
  const between = Math.max(...spectrum(wave(100.5 * bin, 1), periodS).amplitude);
  assert(between > 0.84 && between < 0.86, `${between}`);
  // All that is shown counts, however long that is: a wave in the first part of 1000 values, and one all along.
  const short = Array.from({ length: 1000 }, (_, i) => (i < 400 ? Math.sin(2 * Math.PI * 50 * i * periodS) : 0));
  assert(Math.max(...spectrum(short, periodS).amplitude) > 0.1, "the first part is left out");
  const whole = Array.from({ length: 1000 }, (_, i) => 2 * Math.sin(2 * Math.PI * 50 * i * periodS));
  const { frequency: at, amplitude: found } = spectrum(whole, periodS), peak = found.indexOf(Math.max(...found));
  assert(Math.abs(at[peak] - 50) < 0.5 && Math.abs(found[peak] - 2) < 0.05, `${found[peak]} at ${at[peak]} Hz`);
  assert.equal(crossing([0, 1, null, 5, 6], "rising", 5.5, 0), 4);
  assert.equal(crossing([0, 1, null, 5, 6], "rising", 3, 0), -1);  // nobody knows when
  assert.equal(crossing([2, 1, 0], "falling", 1, 0), 1);
  const rows = new ScopeRows(["a"], 4);
  const data = (from, count) => ({ newest: from + count - 1, periods: Array.from({ length: count }, (_, i) => from + i), values: [Array(count).fill(1)] });
  rows.take(data(10, 3));
  rows.take(data(15, 3));
  assert.deepEqual([rows.periods, rows.lost, rows.next()], [[12, 15, 16, 17], 2, 18]);
  rows.take(data(1, 2));
  assert.deepEqual([rows.periods, rows.lost], [[1, 2], 0]);
}

/** period -> [setpoint, measured] */
function read(path) {
  const lines = readFileSync(path, "utf8").split("\n").filter((line) => line && !line.startsWith("#"));
  const head = lines[0].split(",").map((name) => name.replace(/[ ([].*$/, "").replace(/"/g, ""));
  const at = ["period", "X.setpoint", "X.measured"].map((name) => head.findIndex((one) => one === name));
  assert(at.every((column) => column >= 0), `${path} has ${lines[0]}`);
  return new Map(lines.slice(1).map((line) => line.split(",")).map((cells) => [Number(cells[at[0]]), at.slice(1).map((column) => Number(cells[column]))]));
}

async function catches(page, mover) {
  const file = join(folder, "command.csv");
  const command = spawn(trunnion, ["scope", "X.setpoint", "X.measured", "--trigger", "rising X.setpoint 5", "--before", "0.4",
    "--seconds", "1.2", "--csv", file, "--machine", config], { stdio: "ignore" });
  const ended = new Promise((done) => command.on("exit", done));
  await part(page, "trigger-signal").selectOption("X.setpoint");
  await part(page, "trigger-level").fill("5");
  await part(page, "scope-window").selectOption("1");
  await part(page, "scope-trigger").click();
  await until(page, "scope-text", (shown) => shown.includes("Waits until X.setpoint crosses 5, rising."), "waits");
  await rest(1000);
  await part(mover, "mdi").fill("G0 X20");
  await part(mover, "mdi").press("Enter");
  await page.locator('[data-test="scope-stop"][aria-pressed="true"]').waitFor();
  assert.equal(await ended, 0, "trunnion scope caught nothing");
  const [download] = await Promise.all([page.waitForEvent("download"), part(page, "scope-save").click()]);
  await download.saveAs(join(folder, "page.csv"));
  const told = read(join(folder, "page.csv")), known = read(file);
  let compared = 0, moved = 0;
  for (const [period, values] of told) {
    const other = known.get(period);
    if (!other) continue;
    ++compared;
    values.forEach((value, k) => assert(Math.abs(value - other[k]) < 2e-6, `period ${period}: ${values} and ${other}`));
    if (values[0] > 5) ++moved;
  }
  assert(told.size === 1000 && compared > 700 && moved > 300, `${told.size} rows, ${compared} compared, ${moved} behind the trigger`);
}

async function cursors(page) {
  const box = await part(page, "plot").locator(".u-over").boundingBox();
  await page.mouse.click(box.x + box.width * 0.3, box.y + box.height / 2);
  await page.mouse.click(box.x + box.width * 0.7, box.y + box.height / 2);
  const between = await part(page, "cursors").locator("tbody tr").first().locator("td").last().textContent();
  assert(Math.abs(Number(between) - 0.4) < 0.01, `0.4 of a second stands as ${between}`);
}

try {
  checkFunctions(await functions());
  const mover = await open({ width: 1280, height: 800 });
  const page = await open({ width: 1280, height: 800 });
  await until(mover, "state", (shown) => shown === "Ready", "Ready");
  await part(mover, "take").click();
  await part(mover, "mdi").fill("G0 X0");
  await part(mover, "mdi").press("Enter");
  await page.getByRole("tab", { name: "Scope" }).click();
  await until(page, "scope-text", (shown) => shown.includes("values a second"), "runs");
  await catches(page, mover);
  await cursors(page);
  await picture(page, "scope_dark");
  await part(page, "scope-fft").click();
  await picture(page, "scope_fft");
  await part(page, "scope-fft").click();
  const tablet = await open({ width: 820, height: 1180 }, { colorScheme: "light" });
  await tablet.getByRole("tab", { name: "Scope" }).click();
  await until(tablet, "scope-text", (shown) => shown.includes("values a second"), "runs");
  await part(tablet, "scope-filter").fill("following");
  await part(tablet, "signal-X.following_error").check();
  await part(mover, "mdi").fill("G0 X0");
  await part(mover, "mdi").press("Enter");
  await rest(1500);
  await picture(tablet, "scope_tablet_light");
  assert.deepEqual(complaints, [], "the browser complains");
  console.log("the scope shows what there was");
} catch (error) {
  console.error(error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
}
