/** How long pages of 1,000 and of 10,000 bodies take to load, and how fast they can be scrubbed, drawing in software. */

import { statSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { Browser } from "./browser.mjs";

/** What is asked for of 1,000 bodies: seconds, frames per second, bytes. Of 10,000 the figures are told. */
const [LOAD, SCRUB, SIZE] = [3, 20, 20e6];
/** Frames that are scrubbed to. */
const FRAMES = 80;

const pathOf = (name) => fileURLToPath(new URL(`out/${name}.html`, import.meta.url));
const browser = await Browser.start();
await (await browser.open(pathOf("warm"))).close(); // warms the browser up
const large = await measured("large");
tell(large, true);
tell(await measured("many"), false);
await browser.close();
process.exitCode = large.load < LOAD && large.rate >= SCRUB && large.size < SIZE ? 0 : 1;

/** Opens a page and scrubs through it. */
async function measured(name) {
  const begun = performance.now();
  const page = await browser.open(pathOf(name));
  const load = (performance.now() - begun) / 1000;
  const told = await page.evaluate(scrub, FRAMES);
  await page.close();
  return { ...told, load, size: statSync(pathOf(name)).size };
}

/** Runs in the page: frames per second while the scrubber is moved once per frame. */
async function scrub(frames) {
  const { clock, view, replays } = window.carom;
  const next = () => new Promise((done) => requestAnimationFrame(done));
  const slider = document.querySelector(".scrubber");
  await next();
  const start = performance.now();
  for (let i = 1; i <= frames; i++) {
    slider.value = String(Math.round((i * Math.max(1, (clock.frames - 1) / frames)) % clock.frames));
    slider.dispatchEvent(new Event("input"));
    await next();
  }
  const seconds = (performance.now() - start) / 1000;
  const { canvas } = view.stage;
  return {
    rate: frames / seconds,
    bodies: replays[0].bodies,
    frames: clock.frames,
    canvas: [canvas.width, canvas.height],
  };
}

function tell({ bodies, frames, canvas, size, load, rate }, asked) {
  const goal = (text) => (asked ? `  (asked: ${text})` : "");
  console.log(`bodies ${bodies}, frames ${frames}, canvas ${canvas.join(" × ")} pixels, software rendering`);
  console.log(`size    ${(size / 1e6).toFixed(2)} MB${goal(`below ${SIZE / 1e6}`)}`);
  console.log(`load    ${load.toFixed(2)} s${goal(`below ${LOAD}`)}`);
  console.log(`scrub   ${rate.toFixed(1)} frames/s${goal(`${SCRUB} or more`)}`);
}
