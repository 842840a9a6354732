// The page on screens from a telephone's to that of a machine, and what it says of a turned offset, of numbers that nobody can
// mean and of a program while one looks ahead in it. Pictures go into the output folder.
//
// usage: node page_screens.mjs ORIGIN KEY PAGE_SOURCES OUTPUT_FOLDER SHORT_PROGRAM LONG_PROGRAM [CHECK...]
import assert from "node:assert/strict";
import { join } from "node:path";
import { kPatienceMs, launch } from "./page_browser.mjs";

const [origin, key, sources, output, short, long, ...wanted] = process.argv.slice(2);
const { browser, open, part, until, complaints } = await launch(origin, key, sources);
const kTelephone = [{ width: 360, height: 800 }, { hasTouch: true, isMobile: true }];
const kTouchPanel = [{ width: 800, height: 480 }];
const kZoomed = [{ width: 640, height: 400 }];  // 1280 x 800 at 200 %
const kWork = [{ width: 1280, height: 800 }];
const kTouch = 44;

const rest = (ms) => new Promise((done) => setTimeout(done, ms));
const picture = (page, name) => page.screenshot({ path: join(output, `${name}.png`) });
const shows = (page, name, text) => until(page, name, (shown) => shown.includes(text), `"${text}"`);
const view = (page, name) => page.getByRole("tab", { name: new RegExp(`^${name}`) }).click();

async function visit(screen) {
  const page = await open(...screen);
  await shows(page, "state", "Ready");
  await shows(page, "take", "Take the controls");
  await part(page, "take").click();
  await shows(page, "controls", "You have the controls");
  return page;
}

async function leave(page) {
  await part(page, "give-up").click();
  await part(page, "take").waitFor();
  await page.context().close();
}

async function load(page, name) {
  await part(page, "load-name").fill(name);
  await part(page, "load").click();
  await shows(page, "program", name);
}

/** The elements of `found` that a finger does not reach, once scrolled to if `scrolls`, or that are too small for one. */
const unreached = (found, scrolls, least = 0) => found.evaluateAll((all, [scrolls, least]) => all.flatMap((one) => {
  if (scrolls) one.scrollIntoView({ block: "center", inline: "center", behavior: "instant" });
  const box = one.getBoundingClientRect();
  const at = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
  const whole = box.left >= 0 && box.right <= innerWidth && box.top >= 0 && box.bottom <= innerHeight;
  const free = at === one || one.contains(at);
  const large = box.width >= least && box.height >= least;
  const what = `${one.textContent} (${Math.round(box.x)}, ${Math.round(box.y)}, ${Math.round(box.width)} x ${Math.round(box.height)})`;
  return whole && free && large ? [] : [`${what}: ${!whole ? "not on the screen" : free ? "small" : `under ${at?.className}`}`];
}), [scrolls, least]);

const heightOf = async (page, what) => (await page.locator(what).boundingBox()).height;

async function fits(page, width) {
  assert.equal(await page.evaluate(() => Math.max(innerWidth, document.documentElement.scrollWidth)), width, "the page is wider");
  // Beside the tabs, which are scrolled.
  assert.deepEqual(await unreached(page.locator("header button, footer button"), false, kTouch), []);
}

/** Path on a telephone: nothing lies over anything. */
async function telephonePath() {
  const page = await visit(kTelephone);
  await load(page, short);
  await view(page, "Path");
  await part(page, "plan-time").waitFor();
  await picture(page, "screen_360_path");
  assert.deepEqual(await unreached(page.locator("main button"), true, kTouch), []);
  assert.equal(await page.locator("main button").count(), 13);
  await fits(page, 360);
  const scene = await part(page, "scene").boundingBox();
  assert(scene.width > 300 && scene.height > 200, `the drawing is ${scene.width} x ${scene.height}`);
  await leave(page);
}

/** Head and foot of a telephone leave the most of it to what they stand around. */
async function telephoneHead() {
  const page = await visit(kTelephone);
  await fits(page, 360);
  const top = (await page.locator("main").boundingBox()).y;
  assert(top <= 150, `the head has ${top} px`);
  assert(await heightOf(page, "footer") <= 120, `the foot has ${await heightOf(page, "footer")} px`);
  const rows = await Promise.all(["start", "hold", "stop"].map(async (name) => (await part(page, name).boundingBox()).y));
  assert.equal(new Set(rows).size, 1, `Start, Hold and Stop stand at ${rows}`);
  for (const name of ["Offsets and tools", "Machine", "Scope", "Alarms", "All machines", "Run"]) {
    await view(page, name);
    await fits(page, 360);
    await picture(page, `screen_360_${name.replaceAll(" ", "_")}`);
  }
  await leave(page);
}

/** On a touch panel of 800 x 480 the positions, the state and what stops the machine are seen without scrolling. */
async function touchPanel() {
  const page = await visit(kTouchPanel);
  await picture(page, "screen_800_run");
  const seen = ["work-X", "work-Y", "work-Z", "state", "sentence", "start", "hold", "stop", "estop"];
  for (const name of seen) assert.deepEqual(await unreached(part(page, name), false), [], name);
  await fits(page, 800);
  await load(page, short);
  await view(page, "Path");
  await part(page, "plan-time").waitFor();
  await picture(page, "screen_800_path");
  assert.deepEqual(await unreached(page.locator("main button"), false, kTouch), []);
  await leave(page);
}

/** At 200 % all that can be pressed is reached, and more than half of the screen is left to the view. */
async function zoomed() {
  const page = await visit(kZoomed);
  await load(page, short);
  for (const name of ["Path", "Offsets and tools", "Machine", "Scope", "Alarms", "All machines", "Run"]) {
    await view(page, name);
    await fits(page, 640);
    assert.deepEqual(await unreached(page.locator("main button, main input:not([type=file])"), true), [], name);
    await page.locator("main").evaluate((main) => main.scrollTo(0, 0));
    await picture(page, `screen_640_${name.replaceAll(" ", "_")}`);
  }
  const left = await heightOf(page, "main");
  assert(left > 200, `${left} px of 400 are left`);
  await leave(page);
}

/** Where the text of the program stands. */
const lines = async (page) => (await part(page, "lines").locator(".row > span").allTextContents()).map(Number);

/** While a program runs one may look ahead in it, by wheel, keys and bar; a button leads back to the running line. */
async function looksAhead() {
  const page = await visit(kWork);
  await load(page, long);
  await part(page, "start").click();
  await until(page, "running-line", (shown) => /X/.test(shown), "a line of motion");
  const passes = async () => {
    const from = await page.locator(".named small").textContent();
    for (const end = Date.now() + kPatienceMs; (await page.locator(".named small").textContent()) === from; await rest(50))
      assert(Date.now() < end, "the program does not go on");
  };
  const stays = async (how) => {
    await part(page, "follow").waitFor();
    let seen = [];  // what scrolls smoothly comes to its end
    for (const end = Date.now() + kPatienceMs; String(seen) !== String(await lines(page)); await rest(500)) {
      assert(Date.now() < end, `the text does not come to rest after ${how}`);
      seen = await lines(page);
    }
    for (let i = 0; i < 3; ++i) await passes();
    assert.deepEqual(await lines(page), seen, `the text does not stay where ${how} brought it`);
    await picture(page, "looks_ahead");
    await part(page, "follow").click();
    await part(page, "follow").waitFor({ state: "detached" });
    for (let i = 0; i < 3; ++i) await passes();
    await part(page, "running-line").waitFor();
    assert.equal(await part(page, "follow").count(), 0, "it does not follow any more");
  };
  await part(page, "lines").evaluate((box) => (box.scrollTop = box.scrollHeight));  // as a bar does that is dragged
  await stays("the bar");
  await part(page, "lines").focus();
  await page.keyboard.press("End");
  await stays("a key");
  await part(page, "lines").hover();
  await page.mouse.wheel(0, 4000);
  await stays("the wheel");
  await part(page, "stop").click();
  await shows(page, "state", "Ready");
  await leave(page);
}

/** A turned offset is told at the positions, beside the codes and in the table. */
async function turned() {
  const page = await visit(kWork);
  const type = async (line) => {
    await part(page, "mdi").fill(line);
    await page.getByRole("button", { name: "Run line" }).click();
  };
  assert.equal(await part(page, "work-turned").count(), 0);
  await type("G10 L2 P1 R30");
  await shows(page, "work-turned", "turned 30°");
  await shows(page, "force-Work offset", "G54, turned by 30°");
  await picture(page, "turned_run");
  await view(page, "Offsets and tools");
  await shows(page, "rotation-G54", "30°");
  await shows(page, "rotation-G55", "–");
  await shows(page, "turned", "“G10 L2 P1 R0” turns it back");
  await picture(page, "turned_offsets");
  await view(page, "Run");
  await type("G10 L2 P1 R0");
  await part(page, "work-turned").waitFor({ state: "detached" });
  await leave(page);
}

/** What nobody can mean is not sent. */
async function farNumbers() {
  const page = await visit(kWork);
  await view(page, "Offsets and tools");
  const enabled = (name) => part(page, name).and(page.locator(":enabled")).waitFor();
  await part(page, "set-X").fill("99999");
  await enabled("set-offset");
  for (const far of ["99999999999", "-100001"]) {
    await part(page, "set-X").fill(far);
    await shows(page, "too-far", `${far} is too much: 100000 mm at most.`);
    assert(await part(page, "set-offset").isDisabled() && await part(page, "touch-off").isDisabled(), far);
  }
  await part(page, "set-X").fill("");
  await part(page, "tool-2").click();
  await part(page, "tool-length").fill("81");
  await enabled("set-tool");
  for (const name of ["tool-length", "tool-diameter"]) {
    await part(page, name).fill("99999999999");
    await shows(page, "too-far", "100000 mm at most");
    assert(await part(page, "set-tool").isDisabled(), name);
    await part(page, name).fill("8");
    await enabled("set-tool");
  }
  await part(page, "tool-pocket").fill("99999999999");
  await shows(page, "too-great", "eight digits");
  assert(await part(page, "set-tool").isDisabled(), "the pocket");
  await leave(page);
}

/** A name that the panel does not keep is refused in words that say which it would. */
async function names() {
  const page = await visit(kWork);
  await part(page, "upload").setInputFiles({ name: "Gehäuse ü.ngc", mimeType: "text/plain", buffer: Buffer.from("G21\nM2\n") });
  await shows(page, "not-sent", "“Gehäuse ü.ngc” is not sent.");
  await shows(page, "not-sent", "letters from a to z");
  await part(page, "upload").setInputFiles({ name: "Gehaeuse.ngc", mimeType: "text/plain", buffer: Buffer.from("G21\nM2\n") });
  await shows(page, "program", "Gehaeuse.ngc");
  assert.equal(await part(page, "not-sent").count(), 0);
  await leave(page);
}

/** All that the log says stands in columns. */
async function columns() {
  const page = await visit(kWork);
  await part(page, "estop").click();
  await part(page, "reset").click();
  await shows(page, "state", "Ready");
  await view(page, "Alarms");
  await page.locator(".log .kind", { hasText: "fault" }).first().waitFor();
  await picture(page, "log_columns");
  for (const column of ["time", ".kind", "span:last-child"]) {
    const edges = await page.locator(`.log li ${column}`).evaluateAll((all) => all.map((one) => Math.round(one.getBoundingClientRect().x)));
    assert.equal(new Set(edges).size, 1, `${column} begins at ${[...new Set(edges)]}`);
  }
  const kinds = new Set(await page.locator(".log .kind").allTextContents());
  assert(kinds.has("controls") && kinds.has("fault"), [...kinds].join());
  await leave(page);
}

const kChecks = { telephonePath, telephoneHead, touchPanel, zoomed, turned, farNumbers, names, columns, looksAhead };
try {
  for (const [name, check] of Object.entries(kChecks)) if (!wanted.length || wanted.includes(name)) await check();
  assert.deepEqual(complaints, [], "the browser complains");
  console.log("the page fits its screens");
} catch (error) {
  console.error(error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
}
