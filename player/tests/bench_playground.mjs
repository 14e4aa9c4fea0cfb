/** Steps per second of 500 bodies in the playground, on one core; ends with 1 below 60. */

import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { Browser } from "./browser.mjs";

const PAGE = join(dirname(fileURLToPath(import.meta.url)), "../dist-playground/playground.html");
const ASKED = 60;

const browser = await Browser.start();
const page = await browser.context.newPage();
const begun = performance.now();
await page.goto(pathToFileURL(PAGE).href);
await page.waitForFunction(() => window.playground || window.caromError, null, { timeout: 60_000 });
console.log(`ready after ${((performance.now() - begun) / 1000).toFixed(2)} s`);
let slowest = Number.POSITIVE_INFINITY;
for (const scene of ["pile_500", "pile_500_spatial"]) {
  await page.selectOption("header select", scene);
  const parts = await page.evaluate(() => {
    const found = [];
    for (let part = 0; part < 6; part++) {
      const from = performance.now();
      window.playground.run(60);
      found.push(60_000 / (performance.now() - from));
    }
    return found;
  });
  const told = parts.map((rate) => rate.toFixed(0)).join(", ");
  console.log(`${scene}: steps per second, second by second of the run: ${told}`);
  slowest = Math.min(slowest, ...parts);
}
await browser.close();
if (slowest < ASKED) {
  console.error(`asked for ${ASKED} steps per second, the slowest was ${slowest.toFixed(0)}`);
  process.exit(1);
}
