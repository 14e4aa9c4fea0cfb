/** A browser for the tests: Debian's Chromium, drawing in software, without network. */

import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const PLACES = [process.env.CAROM_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser"];
/** Quiet, without network of its own, WebGL by software. */
const FLAGS = [
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
];

/** Where Chromium is. */
export function chromiumPath() {
  const found = PLACES.find((place) => place && existsSync(place));
  if (!found) throw new Error("No Chromium: run tools/install_chromium.sh, or name one in CAROM_CHROMIUM.");
  return found;
}

/** A browser that notes every request, error and message of its pages. */
export class Browser {
  static async start(options = {}) {
    const folder = mkdtempSync(join(tmpdir(), "carom-browser-"));
    const context = await chromium.launchPersistentContext(folder, {
      executablePath: chromiumPath(),
      headless: true,
      chromiumSandbox: false,
      args: FLAGS,
      viewport: { width: 1280, height: 800 },
      ...options,
    });
    return new Browser(context, folder);
  }

  constructor(context, folder) {
    this.context = context;
    this.folder = folder;
  }

  /** Opens a page from a file and waits until it is ready. */
  async open(file, { width = 1280, height = 800, dark = false } = {}) {
    const page = await this.context.newPage();
    page.requests = [];
    page.complaints = [];
    page.on("request", (request) => page.requests.push(request.url()));
    page.on("pageerror", (error) => page.complaints.push(String(error)));
    page.on("console", (message) => {
      if (["error", "warning"].includes(message.type())) page.complaints.push(message.text());
    });
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme: dark ? "dark" : "light" });
    await page.goto(pathToFileURL(file).href);
    await page.waitForFunction(() => window.carom || window.caromError, null, { timeout: 60_000 });
    const failure = await page.evaluate(() => window.caromError);
    if (failure) throw new Error(failure);
    await settled(page);
    return page;
  }

  async close() {
    await this.context.close();
    rmSync(this.folder, { recursive: true, force: true });
  }
}

/** Waits until two frames have been drawn. */
export function settled(page) {
  return page.evaluate(
    () =>
      new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30)))),
  );
}
