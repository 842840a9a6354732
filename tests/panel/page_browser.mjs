// A browser for the tests of the page, without a display and with WebGL made by software.
import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { join } from "node:path";

export const kPatienceMs = 90000;  // a busy host needs half a minute to load a page

const kStandsMs = 2000;

/** Holds the button down until `done`; tells how often it was pressed for that. On a busy host the dead man may let go. */
export async function holdsUntil(page, button, done, what) {
  const end = Date.now() + kPatienceMs;
  const shown = () => page.locator('[data-test="state"]').first().textContent();
  for (let presses = 1; ; ++presses) {
    await page.locator(`[data-test="${button}"]`).click({ trial: true });
    const box = await page.locator(`[data-test="${button}"]`).boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    for (let moved = Date.now(); Date.now() - moved < kStandsMs; ) {
      if (await done()) return presses;
      if (Date.now() > end) assert.fail(`${button} is held down, and never ${what}`);
      if ((await shown()) !== "Ready") moved = Date.now();
    }
    await page.mouse.up();
  }
}

/** Keeps what the browser says. A plan that was told may be gone when it is asked for, as the next one is begun: that is no error. */
export function complain(complaints, line) {
  const said = `${line.text()} ${line.location().url}`;
  if (!/ 404 .*\/api\/v1\/plan$/.test(said)) complaints.push(said);
}

/** `open` opens a page of the panel with its key, `before` runs in it before anything else; `complaints` is what the browser says against the page. */
export async function launch(origin, key, sources) {
  const { chromium } = createRequire(join(sources, "package.json"))("playwright-core");
  const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
  const complaints = [];
  const open = async (size, options = {}, before = () => {}) => {
    const context = await browser.newContext({ viewport: size, colorScheme: "dark", ...options });
    await context.addInitScript(before);
    const page = await context.newPage();
    page.setDefaultTimeout(kPatienceMs);
    page.on("pageerror", (error) => complaints.push(String(error.stack ?? error)));
    page.on("console", (line) => line.type() === "error" && complain(complaints, line));
    await page.goto(key ? `${origin}/#key=${key}` : `${origin}/`);
    return page;
  };
  const part = (page, name) => page.locator(`[data-test="${name}"]`);
  /** Waits until the element's text satisfies `wanted`; from here, as the page's policy lets no code be made of text. */
  const until = async (page, name, wanted, what) => {
    const end = Date.now() + kPatienceMs;
    for (;;) {
      const shown = await part(page, name).first().textContent();
      if (wanted(shown)) return shown;
      if (Date.now() > end) assert.fail(`${name} shows "${shown}" and never ${what}`);
      await new Promise((done) => setTimeout(done, 20));
    }
  };
  return { browser, open, part, until, complaints };
}
