// The page of one machine: the machine is drawn and, behind a daemon, stands where its joints are.
//
// usage: node page_machines.mjs ORIGIN KEY PAGE_SOURCES PICTURE live|alone [BODIES]
//
// BODIES: the boxes of a cradle's drawings, [[low, high], ...]: base, table, joint A, joint Z.
import assert from "node:assert/strict";
import { kPatienceMs, launch } from "./page_browser.mjs";

const [origin, key, sources, picture, how, bodies] = process.argv.slice(2);

/** The boxes of all that is drawn by triangles of a file, with A and Z where they are said to be. */
const drawn = (page, a, z) => part(page, "scene").evaluate((host, [a, z]) => {
  const { shown } = host.scene;
  shown.place({ q_measured: [0, 0, z, a, 0], machine: [0, 0, z, a, 0, 0] });
  shown.root.updateMatrixWorld(true);
  const boxes = [];
  shown.root.traverse((one) => {
    if (!one.isMesh || one.geometry.type !== "BufferGeometry") return;
    one.geometry.computeBoundingBox();
    const box = one.geometry.boundingBox.clone().applyMatrix4(one.matrixWorld);
    boxes.push([box.min.toArray(), box.max.toArray()]);
  });
  let castings = 0;
  shown.root.traverse((one) => (castings += one.geometry?.type === "BoxGeometry" ? 1 : 0));
  return { boxes, castings };
}, [a, z]);

function near(boxes, wanted) {
  const found = (box) => boxes.some((one) => one.flat().every((value, i) => Math.abs(value - box.flat()[i]) < 1e-3));
  for (const box of wanted) assert(found(box), `no body from ${box[0]} to ${box[1]} in ${JSON.stringify(boxes)}`);
}

async function lieAsDrawn(page, wanted) {
  let seen = { boxes: [], castings: 1 };
  for (const end = Date.now() + kPatienceMs; seen.castings && Date.now() < end; ) seen = await drawn(page, 0, 0);
  assert.equal(seen.castings, 0, "our own castings stay");
  near(seen.boxes, wanted);
  // A turns by 90 degrees: what lay along +Y points to +Z. Z moves up by 100.
  const turned = ([low, high]) => [[low[0], -high[2], low[1]], [high[0], -low[2], high[1]]];
  const up = ([low, high]) => [[low[0], low[1], low[2] + 100], [high[0], high[1], high[2] + 100]];
  const [base, table, a, z] = wanted;
  near((await drawn(page, Math.PI / 2, 100)).boxes, [base, turned(table), turned(a), up(z)]);
  await drawn(page, 0.6, 0);
}

const { browser, open, part, until, complaints } = await launch(origin, key, sources);
try {
  const page = await open({ width: 1280, height: 800 });
  const wanted = how === "live" ? "Ready" : "No machine";
  await until(page, "state", (shown) => shown === wanted, wanted);
  await page.keyboard.press("2");
  await part(page, "scene").locator("canvas").waitFor();
  if (bodies) await lieAsDrawn(page, JSON.parse(bodies));
  await part(page, "fit-machine").click();
  // A picture of the background alone has one colour; flat faces have one each.
  const colours = await part(page, "scene").evaluate(async (host) => host.scene.colours());
  await page.screenshot({ path: picture });
  assert(colours > (bodies ? 8 : 10), `the machine is drawn in ${colours} colours only`);
  assert.deepEqual(complaints, [], "the browser complains");
} catch (error) {
  console.error(picture, error, complaints);
  process.exitCode = 1;
} finally {
  await browser.close();
}
