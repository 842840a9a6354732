// Makes panel_run.png, panel_path.png and panel_machine.png of a page at work: ./run.sh --panel, then, with the address that it prints,
//
//     node docs/make_panel_pictures.mjs ADDRESS
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const docs = dirname(fileURLToPath(import.meta.url));
const { chromium } = createRequire(join(docs, "../panel/page/package.json"))("playwright-core");
const kPatienceMs = 300000;
const kPicture = 1500;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, colorScheme: "dark" });
page.setDefaultTimeout(kPatienceMs);
const view = (name) => page.getByRole("tab", { name: new RegExp(`^${name}`) }).click();
const line = async () => Number(await page.locator('[data-test="path-line"]').textContent());

async function untilLine(wanted) {
  const end = Date.now() + kPatienceMs;
  while (!((await line()) >= wanted)) {
    if (Date.now() > end) throw new Error(`the program never came to line ${wanted}`);
    await new Promise((done) => setTimeout(done, 100));
  }
}

await page.goto(process.argv[2]);
await page.locator('[data-test="take"]').click();
await page.locator('[data-test="resume"]').click();  // the tool is in the spindle
await view("Path");
await untilLine(kPicture);
await page.screenshot({ path: join(docs, "panel_path.png") });
await page.locator('[data-test="fit-machine"]').click();
await page.screenshot({ path: join(docs, "panel_machine.png") });
await view("Run");
await page.locator('[data-test="work-X"]').waitFor();
await page.screenshot({ path: join(docs, "panel_run.png") });
await browser.close();
