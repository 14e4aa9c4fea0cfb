/**
 * Pictures that are kept, and how far a new one may be from them. Drawing in software differs a little from
 * version to version, so pictures are compared after blurring, by the mean and the largest difference.
 * CAROM_NEW_REFERENCES=1 keeps the new pictures; look at them before committing them.
 */

import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";

const FOLDER = new URL("references/", import.meta.url);
const OUT = new URL("out/", import.meta.url);
/** Largest mean difference, and largest difference of a blurred pixel, of 255 [1]. */
const MEAN = 2.5;
const LARGEST = 70;

/** Compares what the page shows with the picture of that name. */
export async function compareWithReference(page, name) {
  const reference = new URL(`${name}.png`, FOLDER);
  const shown = await page.screenshot();
  if (process.env.CAROM_NEW_REFERENCES) {
    mkdirSync(FOLDER, { recursive: true });
    writeFileSync(reference, shown);
    return;
  }
  assert.ok(existsSync(reference), `no picture ${name}; make it with CAROM_NEW_REFERENCES=1`);
  writeFileSync(new URL(`${name}.png`, OUT), shown);
  const [mean, largest] = await page.evaluate(difference, [
    readFileSync(reference).toString("base64"),
    shown.toString("base64"),
  ]);
  assert.ok(
    mean <= MEAN,
    `${name} differs by ${mean.toFixed(2)} of 255 in the mean; see tests/out/${name}.png`,
  );
  assert.ok(largest <= LARGEST, `${name} differs by ${largest.toFixed(0)} of 255 somewhere; see tests/out`);
}

/** Mean and largest difference of two pictures, a quarter as large; runs in the page. */
async function difference(pictures) {
  const [one, other] = await Promise.all(
    pictures.map(async (picture) => {
      const bytes = Uint8Array.from(atob(picture), (letter) => letter.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const [width, height] = [Math.round(bitmap.width / 4), Math.round(bitmap.height / 4)];
      const context = new OffscreenCanvas(width, height).getContext("2d");
      context.imageSmoothingQuality = "high";
      context.drawImage(bitmap, 0, 0, width, height);
      return context.getImageData(0, 0, width, height).data;
    }),
  );
  if (one.length !== other.length) return [255, 255];
  let [sum, largest] = [0, 0];
  for (let i = 0; i < one.length; i++) {
    const apart = Math.abs(one[i] - other[i]);
    sum += apart;
    largest = Math.max(largest, apart);
  }
  return [sum / one.length, largest];
}
