// What a page in a real browser says when the network is cut, the panel hangs, or the daemon starts anew while a button is
// held: the machine stands, the page says that what it shows is old, and nothing moves by itself afterwards.
//
// usage: node page_faults.mjs ORIGIN KEY PAGE_SOURCES OUTPUT_FOLDER; page_faults.py does what is asked for on stdout.
import assert from "node:assert/strict";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { holdsUntil, launch } from "./page_browser.mjs";

const [origin, key, sources, output] = process.argv.slice(2);
const { browser, open, part, until, complaints } = await launch(origin, key, sources);
const answers = createInterface({ input: process.stdin })[Symbol.asyncIterator]();
const picture = (page, name) => page.screenshot({ path: join(output, `${name}.png`) });
const rest = (ms) => new Promise((done) => setTimeout(done, ms));
const shows = (page, name, wanted) => until(page, name, (shown) => shown.includes(wanted), `"${wanted}"`);

/** Lets the script that started this one do something; what it answers. */
async function ask(what) {
  console.log(`DO ${what}`);
  return (await answers.next()).value;
}

async function holdButton(page) {
  await shows(page, "state", "Ready");
  const moves = async () => (await part(page, "state").first().textContent()) === "Moving by hand";
  await holdsUntil(page, "jog-X+", moves, "it moves by hand");
}

/** The machine stands within a second, as the daemon itself tells, and goes nowhere from there. */
async function stands() {
  await rest(1000);
  const place = Number(await ask("place"));
  await rest(700);
  assert.equal(Number(await ask("place")), place, "the machine moves on");
  return place;
}

async function recovers(page, place) {
  await shows(page, "state", "Ready");
  await page.mouse.up();
  await rest(700);
  assert.equal(Number(await ask("place")), place, "the machine moved when the page came back");
}

async function takes(page) {
  await until(page, "take", (shown) => shown === "Take the controls" || shown === "Take them now", "free");
  await part(page, "take").click();
  await shows(page, "controls", "You have the controls");
  await part(page, "held").click();
}

/** Behind a cut line the panel has not noticed yet that the first connection is dead: it has the controls still. */
async function takesAnew(page) {
  await part(page, "take").waitFor();
  if ((await part(page, "take").textContent()) === "Ask for the controls") await part(page, "take").click();
  await takes(page);
}

/** What is shown is old: nothing can be begun by it, and the emergency stop stays. */
async function startsNothingOld(page) {
  if (!(await part(page, "controls").count())) await takes(page);
  await part(page, "load-name").fill("short.ngc");
  await part(page, "load").click();
  await shows(page, "program", "short.ngc");
  const begin = ["start", "load", "home", "jog-X+", "override", "single", "dry-run", "machine-lock"];
  const free = (name) => part(page, name).and(page.locator(":enabled")).waitFor();
  for (const name of begin) await free(name);
  for (const [break_, mend] of [["stop panel", "go on panel"], ["kill daemon", "start daemon"]]) {
    await ask(break_);
    await part(page, "old").waitFor();
    await picture(page, `old_${break_.replace(" ", "_")}`);
    for (const name of begin) assert(await part(page, name).isDisabled(), `${break_}: ${name} can be pressed`);
    assert(await part(page, "estop").isEnabled());
    await ask(mend);
    await part(page, "old").waitFor({ state: "detached" });
    if (mend === "go on panel") for (const name of begin) await free(name);
  }
}

/** A browser that is too slow to say its key in time is let in the next time it tries. */
async function slowBrowser() {
  const page = await open({ width: 1280, height: 800 }, {}, () => {
    const Socket = window.WebSocket;
    window.sockets = 0;
    window.WebSocket = class extends Socket {
      constructor(...how) {
        super(...how);
        if (window.sockets++ === 0) this.send = () => {};
      }
    };
  });
  await shows(page, "state", "Ready");
  assert(await page.evaluate(() => window.sockets) > 1, "the key was not late");
  await page.context().close();
}

try {
  await slowBrowser();
  const page = await open({ width: 1280, height: 800 });
  await shows(page, "state", "Ready");
  await takes(page);

  await holdButton(page);
  await ask("cut");
  const cutAt = await stands();
  await shows(page, "sentence", "what is shown here is old");
  await part(page, "old").waitFor();
  await picture(page, "line_cut");
  assert(await part(page, "estop").isEnabled());
  await ask("mend");
  await recovers(page, cutAt);
  await takesAnew(page);

  await holdButton(page);
  await ask("stop panel");
  const hungAt = await stands();
  await shows(page, "state", "No connection");
  await ask("go on panel");
  await recovers(page, hungAt);
  if (!(await part(page, "controls").count())) await takesAnew(page);

  await holdButton(page);
  await ask("kill daemon");
  await shows(page, "sentence", "No daemon answers for this machine. What is shown here is old.");
  await part(page, "old").waitFor();
  await picture(page, "daemon_gone");
  await ask("start daemon");
  await shows(page, "state", "Ready");
  await part(page, "old").waitFor({ state: "detached" });
  const began = Number(await ask("place"));
  await page.mouse.up();
  await rest(1000);
  assert.equal(Number(await ask("place")), began, "a daemon that began anew moves");
  await startsNothingOld(page);
  assert.deepEqual(complaints.filter((one) => !/ERR_|WebSocket/.test(one)), [], "the browser complains");
  console.log("nothing moved that should not");
} catch (error) {
  console.error(error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
  process.exit();
}
