// Presses a jog button again and again, and notes when each press was and when each number was on the screen (ms of Unix
// time). Prints it as JSON for page_latency.py.
//
// usage: node page_latency.mjs ORIGIN KEY PAGE_SOURCES PRESSES
import { launch } from "./page_browser.mjs";

const [origin, key, sources, presses] = process.argv.slice(2);
const { browser, open, part, until } = await launch(origin, key, sources);
const rest = (ms) => new Promise((done) => setTimeout(done, ms));
try {
  const page = await open({ width: 1280, height: 800 }, { bypassCSP: true });
  await until(page, "state", (shown) => shown === "Ready", "Ready");
  await part(page, "take").click();
  await part(page, "home").click();
  await until(page, "sentence", (shown) => !shown.startsWith("Not homed"), "homed");
  await until(page, "state", (shown) => shown === "Ready", "Ready");
  await part(page, "held").click();
  await page.evaluate(() => {
    const seen = (window.seen = { presses: [], shown: [] });
    const unix = () => performance.timeOrigin + performance.now();
    addEventListener("pointerdown", (event) => seen.presses.push(performance.timeOrigin + event.timeStamp), true);
    const field = document.querySelector('[data-test="machine-X"]');
    new MutationObserver(() => {
      const place = Number(field.textContent);
      // The number stands in the frame after the next begin of one.
      requestAnimationFrame(() => setTimeout(() => seen.shown.push([unix(), place])));
    }).observe(field, { subtree: true, characterData: true, childList: true });
  });
  for (let i = 0; i < Number(presses); ++i) {
    const button = await part(page, i % 2 ? "jog-X-" : "jog-X+").boundingBox();
    await page.mouse.move(button.x + button.width / 2, button.y + button.height / 2);
    await page.mouse.down();
    await rest(700);
    await page.mouse.up();
    await until(page, "state", (shown) => shown === "Ready", "Ready");
    await rest(150 + 13 * (i % 10));
  }
  console.log(JSON.stringify(await page.evaluate(() => window.seen)));
} finally {
  await browser.close();
}
