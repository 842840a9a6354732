// Two people at the page of a panel that is reached over a network: they log in, ask each other for the controls, and are out
// when their session ends. Pictures go into the output folder.
//
// usage: node page_log_in.mjs ORIGIN PAGE_SOURCES OUTPUT_FOLDER
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { launch } from "./page_browser.mjs";

const [origin, sources, output] = process.argv.slice(2);
const { browser, open, part, until, complaints } = await launch(origin, "", sources);
const kWork = { width: 1280, height: 800 };
const kTablet = { width: 820, height: 1180 };
const picture = (page, name) => page.screenshot({ path: join(output, `${name}.png`) });
const shows = (page, name, wanted) => until(page, name, (shown) => shown.includes(wanted), `"${wanted}"`);
const visit = (size, options = {}) => open(size, { ignoreHTTPSErrors: true, ...options });

async function logIn(page, name, password = `${name}'s password`) {
  await page.getByLabel("Name").fill(name);
  await page.getByLabel("Password").fill(password);
  await page.getByRole("button", { name: "Log in" }).click();
}

/** Nothing serious in the way of people who see, hear or move otherwise. */
async function accessible(page, what) {
  // The page's policy lets no script in from elsewhere; the browser's own protocol is not asked.
  await page.evaluate(readFileSync(join(sources, "node_modules/axe-core/axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  const serious = violations.filter((one) => one.impact === "serious" || one.impact === "critical");
  assert.deepEqual(serious.map((one) => `${one.id}: ${one.nodes.map((node) => node.target)}`), [], what);
}

async function wrongPassword() {
  const page = await visit(kTablet, { colorScheme: "light", bypassCSP: true });
  await logIn(page, "otto", "no password of his");
  await shows(page, "log-in-text", "Name or password is wrong.");
  await accessible(page, "the log-in");
  await picture(page, "log_in_light");
  assert.equal((await page.context().cookies()).length, 0);
  await page.context().close();
}

async function seesOnly() {
  const page = await visit(kWork);
  await logIn(page, "lara");
  await shows(page, "user", "may look and stop");
  await shows(page, "state", "Ready");
  assert.equal(await part(page, "take").count(), 0, "who looks is offered the controls");
  assert(await part(page, "estop").isEnabled());
  await picture(page, "looks");
  return page;
}

async function asks(sara, otto) {
  await part(otto, "take").click();
  await shows(otto, "controls", "You have the controls");
  await part(sara, "take").click();
  await shows(otto, "asked", "sara asks for the controls.");
  await shows(sara, "holder", "otto is asked");
  await picture(otto, "asked_dark");
  await picture(sara, "asks_tablet_light");
  await part(otto, "keep").click();
  await shows(sara, "holder", "otto keeps the controls");
  await part(sara, "take").click();
  await part(otto, "give").click();
  await shows(sara, "controls", "You have the controls");
  await shows(otto, "holder", "sara has the controls");
  await part(sara, "give-up").click();
  await shows(otto, "take", "Take the controls");
  await part(otto, "take").click();
  // Nobody answers: after a while they may be taken.
  await part(sara, "take").click();
  await until(sara, "take", (shown) => shown === "Take them now", "may be taken");
  await shows(otto, "asked", "You did not answer");
  await part(sara, "take").click();
  await shows(sara, "controls", "You have the controls");
}

try {
  await wrongPassword();
  const otto = await visit(kWork), sara = await visit(kTablet, { colorScheme: "light" });
  await picture(otto, "log_in_dark");
  await logIn(otto, "otto");
  await logIn(sara, "sara");
  await shows(otto, "user", "may operate");
  await shows(otto, "state", "Ready");
  const [cookie] = await otto.context().cookies();
  assert(cookie.httpOnly && cookie.secure && cookie.sameSite === "Strict");
  assert.equal(await otto.evaluate(() => document.cookie), "", "the page sees the cookie");
  await otto.reload();
  await shows(otto, "state", "Ready");
  await seesOnly();
  await shows(sara, "state", "Ready");
  await asks(sara, otto);
  await part(sara, "log-out").click();
  await part(sara, "log-in").waitFor();
  await until(otto, "take", (shown) => shown === "Take the controls", "free");
  await sara.reload();
  await part(sara, "log-in").waitFor();
  // The browser itself notes each refusal of the server.
  assert.deepEqual(complaints.filter((one) => !/status of (401|4\d\d)/.test(one)), [], "the browser complains");
  console.log("two people logged in and shared the controls");
} catch (error) {
  console.error(error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
}
