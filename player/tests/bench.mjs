/** How long a page of 1,000 bodies takes to load, and how fast it can be scrubbed, drawing in software. */

import { statSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { Browser } from "./browser.mjs";

/** What is asked for: seconds, frames per second, bytes. */
const [LOAD, SCRUB, SIZE] = [3, 20, 20e6];
/** Frames that are scrubbed to. */
const FRAMES = 80;

const file = fileURLToPath(new URL("out/large.html", import.meta.url));
const size = statSync(file).size;
const browser = await Browser.start();
const first = await browser.open(file.replace("large", "plane")).catch(() => undefined); // warms the browser up
await first?.close();
const begun = performance.now();
const page = await browser.open(file);
const load = (performance.now() - begun) / 1000;
const told = await page.evaluate(async (frames) => {
  const { clock, view, replays } = window.carom;
  const next = () => new Promise((done) => requestAnimationFrame(done));
  const slider = document.querySelector(".scrubber");
  await next();
  const start = performance.now();
  for (let i = 1; i <= frames; i++) {
    slider.value = String(Math.round((i * (clock.frames - 1)) / frames));
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
}, FRAMES);
await browser.close();

console.log(
  `bodies ${told.bodies}, frames ${told.frames}, canvas ${told.canvas.join(" × ")} pixels, software rendering`,
);
console.log(`size    ${(size / 1e6).toFixed(2)} MB  (asked: below ${SIZE / 1e6})`);
console.log(`load    ${load.toFixed(2)} s  (asked: below ${LOAD})`);
console.log(`scrub   ${told.rate.toFixed(1)} frames/s  (asked: ${SCRUB} or more)`);
process.exitCode = load < LOAD && told.rate >= SCRUB && size < SIZE ? 0 : 1;
