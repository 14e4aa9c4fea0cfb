/** The replay page in Firefox, drawing in software; `pages.py` made the pages. Run by `make test-firefox`.
 *
 * Without a screen Firefox has no WebGL, so it gets the one of Xvfb. It is driven over Marionette, its own
 * protocol: the one that playwright-core speaks asks for more than the long-lived releases of Firefox know.
 */

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { connect } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";

const OUT = fileURLToPath(new URL("out/", import.meta.url));
const PLACES = [process.env.CAROM_FIREFOX, "/usr/bin/firefox-esr", "/usr/bin/firefox"];
const FLAGS = ["--marionette", "--remote-allow-system-access", "--no-remote"];
const PREFERENCES = {
  "marionette.port": 0, // a free one, which Firefox writes into its profile
  "webgl.force-enabled": true,
  "datareporting.policy.dataSubmissionEnabled": false,
  "browser.shell.checkDefaultBrowser": false,
};
const KEYS = { Space: " ", ArrowRight: "\uE014", ArrowLeft: "\uE012", End: "\uE010", Home: "\uE011" };
/** Put before a page, so that what it says while it starts is noted too. */
const LISTENER = `<script>
window.complaints = [];
for (const how of ["error", "warn"]) console[how] = (...words) => window.complaints.push(words.join(" "));
for (const kind of ["error", "unhandledrejection"])
  addEventListener(kind, (event) => window.complaints.push(String(event.message ?? event.reason)));
</script>`;

const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

/** Asks again and again until there is an answer. */
async function until(question, what, seconds = 60) {
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; await pause(100)) {
    const answer = await question();
    if (answer) return answer;
  }
  throw new Error(`${what}: not within ${seconds} s`);
}

/** A Firefox on a screen of its own. */
class Firefox {
  static async start() {
    const firefox = new Firefox();
    try {
      await firefox.launch();
    } catch (error) {
      firefox.close();
      throw error;
    }
    return firefox;
  }

  folder = mkdtempSync(join(tmpdir(), "carom-firefox-"));
  waiting = new Map();
  last = 0;
  received = Buffer.alloc(0);

  async launch() {
    this.screen = spawn("Xvfb", ["-displayfd", "3", "-screen", "0", "1280x900x24", "-nolisten", "tcp"], {
      stdio: ["ignore", "ignore", "ignore", "pipe"],
    });
    const number = await new Promise((done, fail) => {
      this.screen.once("error", fail);
      this.screen.stdio[3].once("data", (data) => done(String(data).trim()));
    });
    const lines = Object.entries(PREFERENCES).map(
      ([name, value]) => `user_pref("${name}", ${JSON.stringify(value)});`,
    );
    writeFileSync(join(this.folder, "user.js"), lines.join("\n"));
    const place = PLACES.find((place) => place && existsSync(place));
    this.browser = spawn(place, FLAGS.concat("--profile", this.folder), {
      stdio: "ignore",
      env: { ...process.env, DISPLAY: `:${number}`, LIBGL_ALWAYS_SOFTWARE: "1", GDK_BACKEND: "x11" },
    });
    const noted = join(this.folder, "MarionetteActivePort");
    const port = await until(() => existsSync(noted) && Number(readFileSync(noted, "utf8")), "Firefox");
    this.socket = connect(port, "127.0.0.1");
    this.socket.on("data", (data) => this.receive(data));
    await this.send("WebDriver:NewSession", { capabilities: { alwaysMatch: {} } });
    await this.send("WebDriver:SetWindowRect", { x: 0, y: 0, width: 1280, height: 900 });
    await this.inFirefox(`
      globalThis.asked = [];
      Services.obs.addObserver((channel) => {
        const { triggeringPrincipal: who } = channel.QueryInterface(Ci.nsIHttpChannel).loadInfo;
        if (who.schemeIs("file")) globalThis.asked.push(channel.URI.spec);
      }, "http-on-opening-request");
    `);
  }

  /** Messages are their length, a colon and JSON: [1, number, error, result]; the first one is a greeting. */
  receive(data) {
    this.received = Buffer.concat([this.received, data]);
    for (;;) {
      const colon = this.received.indexOf(":");
      const end = colon + 1 + Number(this.received.subarray(0, colon));
      if (colon < 0 || this.received.length < end) return;
      const message = JSON.parse(this.received.subarray(colon + 1, end));
      this.received = this.received.subarray(end);
      if (!Array.isArray(message)) continue;
      const [, number, error, result] = message;
      const { done, fail } = this.waiting.get(number);
      this.waiting.delete(number);
      if (error) fail(new Error(`${error.error}: ${error.message}`));
      else done(result);
    }
  }

  send(command, parameters = {}) {
    const message = JSON.stringify([0, ++this.last, command, parameters]);
    this.socket.write(`${Buffer.byteLength(message)}:${message}`);
    return new Promise((done, fail) => this.waiting.set(this.last, { done, fail }));
  }

  /** What a function makes of its arguments in the page. */
  async evaluate(body, ...args) {
    const script = `return (${body})(...arguments)`;
    return (await this.send("WebDriver:ExecuteScript", { script, args, sandbox: null })).value;
  }

  /** Runs a script with the rights of Firefox itself. */
  async inFirefox(script, ...args) {
    await this.send("Marionette:SetContext", { value: "chrome" });
    try {
      return (
        await this.send("WebDriver:ExecuteScript", { script, args, sandbox: "system", newSandbox: false })
      ).value;
    } finally {
      await this.send("Marionette:SetContext", { value: "content" });
    }
  }

  /** Opens a page and waits until it is ready or has said why not. */
  async open(file, { dark = false, webgl = true } = {}) {
    await this.inFirefox(
      `Services.prefs.setIntPref("layout.css.prefers-color-scheme.content-override", arguments[0] ? 0 : 1);
       Services.prefs.setBoolPref("webgl.disabled", !arguments[1]);
       globalThis.asked.length = 0;`,
      dark,
      webgl,
    );
    const copy = join(this.folder, "page.html");
    writeFileSync(copy, readFileSync(join(OUT, file), "utf8").replace("<head>", `<head>${LISTENER}`));
    await this.send("WebDriver:Navigate", { url: pathToFileURL(copy).href });
    const ready = () => Boolean(window.carom || window.playground || window.caromError);
    await until(() => this.evaluate(ready), file);
    await this.settled();
  }

  /** Waits until two frames have been drawn. */
  async settled() {
    await this.send("WebDriver:ExecuteAsyncScript", {
      script: `const done = arguments[arguments.length - 1];
        requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30)));`,
      args: [],
      sandbox: null,
    });
  }

  async point({ x, y }, click = false) {
    const press = ["pointerDown", "pointerUp"].map((type) => ({ type, button: 0 }));
    const move = { type: "pointerMove", x: Math.round(x), y: Math.round(y), origin: "viewport" };
    const mouse = { type: "pointer", id: "mouse", parameters: { pointerType: "mouse" } };
    const actions = [{ ...mouse, actions: click ? [move, ...press] : [move] }];
    await this.send("WebDriver:PerformActions", { actions });
    await this.settled();
  }

  async press(name) {
    const actions = ["keyDown", "keyUp"].map((type) => ({ type, value: KEYS[name] }));
    await this.send("WebDriver:PerformActions", { actions: [{ type: "key", id: "keys", actions }] });
  }

  async screenshot(name) {
    const { value } = await this.send("WebDriver:TakeScreenshot", { full: false });
    writeFileSync(join(OUT, `firefox-${name}.png`), Buffer.from(value, "base64"));
  }

  close() {
    this.socket?.destroy();
    this.browser?.kill();
    this.screen?.kill();
    rmSync(this.folder, { recursive: true, force: true, maxRetries: 10, retryDelay: 300 });
  }
}

let firefox;
before(async () => {
  mkdirSync(OUT, { recursive: true });
  firefox = await Firefox.start();
});
after(() => firefox?.close());

/** A test with a page that must neither complain nor ask for anything. */
function withPage(name, file, options, body) {
  test(name, async () => {
    await firefox.open(file, options);
    assert.equal(await firefox.evaluate(() => window.caromError), null);
    await body();
    assert.deepEqual(await firefox.evaluate(() => window.complaints), [], "the page complains");
    assert.deepEqual(await firefox.inFirefox("return globalThis.asked"), [], "the page asks the network");
    const loaded = await firefox.evaluate(() =>
      performance
        .getEntriesByType("resource")
        .map(({ name }) => name)
        .filter((name) => !/^(data|blob):/.test(name)),
    );
    assert.deepEqual(loaded, [], "the page loads something beside itself");
  });
}

/** How many colours the scene has, of every 37th pixel, and how bright it is on average, of 255. */
const scene = () =>
  firefox.evaluate(() => {
    const source = window.carom.view.stage.canvas;
    const copy = new OffscreenCanvas(source.width, source.height);
    const context = copy.getContext("2d");
    context.drawImage(source, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    const colours = new Set();
    let [sum, number] = [0, 0];
    for (let i = 0; i < data.length; i += 4 * 37) {
      colours.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
      sum += (data[i] + data[i + 1] + data[i + 2]) / 3;
      number += 1;
    }
    return { colours: colours.size, brightness: sum / number };
  });

const bodyOnPage = (body) =>
  firefox.evaluate((body) => {
    const { view } = window.carom;
    const box = view.stage.canvas.getBoundingClientRect();
    const at = view.bodyOnScreen(body);
    return { x: box.left + at.x, y: box.top + at.y };
  }, body);

for (const name of ["plane", "space", "gallery-plane", "gallery-space"]) {
  for (const dark of [false, true]) {
    const theme = dark ? "dark" : "light";
    withPage(`the scene of ${name} is not blank, ${theme}`, `${name}.html`, { dark }, async () => {
      await firefox.screenshot(`${name}-${theme}`);
      const { colours, brightness } = await scene();
      assert.ok(colours >= 6, `${colours} colours`);
      assert.equal(brightness < 128, dark, `brightness ${brightness}`);
    });
  }
}

withPage("scrubbing moves bodies, plots' cursors and the time", "plane.html", {}, async () => {
  const state = () =>
    firefox.evaluate(() => {
      const { view, plots, clock } = window.carom;
      return { x: view.bodyOnScreen(4).x, cursor: plots.plots[0].cursorLeft, frame: clock.frame };
    });
  const before = await state();
  const slider = await firefox.evaluate(() => {
    const box = document.querySelector(".scrubber").getBoundingClientRect();
    return { x: box.left + (2 / 3) * box.width, y: box.top + box.height / 2 };
  });
  await firefox.point(slider, true);
  await pause(300);
  await firefox.screenshot("scrubbed");
  const after = await state();
  assert.ok(Math.abs(after.frame - 60) <= 2, `frame ${after.frame}`);
  assert.ok(Math.abs(after.x - before.x) > 20, "the disc has rolled");
  assert.ok(after.cursor > before.cursor + 20, "the plots' cursor has moved");
  assert.match(await firefox.evaluate(() => document.querySelector(".time").innerText), /^(0\.9|1\.0)\d+ s$/);
});

withPage("keys play, pause, step and jump", "plane.html", {}, async () => {
  const frame = () => firefox.evaluate(() => window.carom.clock.frame);
  for (const [key, at] of [
    ["ArrowRight", 1],
    ["ArrowRight", 2],
    ["ArrowLeft", 1],
    ["End", 90],
    ["Home", 0],
  ]) {
    await firefox.press(key);
    assert.equal(await frame(), at, key);
  }
  await firefox.press("Space");
  await until(async () => (await frame()) > 3, "playing");
  await firefox.press("Space");
  assert.equal(await firefox.evaluate(() => window.carom.clock.playing), false);
});

withPage("pointing at bodies and at the matrix lights bodies up", "plane.html", {}, async () => {
  const lit = () => firefox.evaluate(() => [...window.carom.selection.hoveredBodies]);
  await firefox.point(await bodyOnPage(2));
  assert.deepEqual(await lit(), [2]);
  await firefox.evaluate(() => {
    window.carom.seek(1.4);
    [...document.querySelectorAll("[role=tab]")].find((tab) => tab.innerText === "Matrix").click();
  });
  await firefox.settled();
  await firefox.point(await firefox.evaluate(() => window.carom.matrix.placeOf(0, 1)));
  await firefox.screenshot("matrix");
  assert.ok((await lit()).length >= 1);
  assert.match(
    await firefox.evaluate(() => document.querySelector(".matrix-panel .told").innerText),
    /share .*: A = .* 1\/kg/,
  );
});

const PLAYGROUND = "../../dist-playground/playground.html";
const NATIVE =
  process.env.CAROM_NATIVE ??
  fileURLToPath(new URL("../../target/debug/examples/fingerprint", import.meta.url));
const built = existsSync(join(OUT, PLAYGROUND));
if (built && !existsSync(NATIVE)) throw new Error(`${NATIVE} is not there: make test-firefox builds it`);
const skip = built ? false : "the playground is not built: make playground";

test("the playground runs, and has the bits of a native build", { skip }, async () => {
  await firefox.open(PLAYGROUND);
  assert.equal(await firefox.evaluate(() => window.caromError), null);
  const from = {
    name: "pyramid_small_planar",
    settings: { scheme: "soft_step", solver: null, impact: null },
  };
  const fingerprint = await firefox.evaluate((state) => {
    window.playground.load(state);
    window.playground.run(200);
    return window.playground.fingerprint();
  }, from);
  await firefox.settled();
  await firefox.screenshot("playground");
  const input = JSON.stringify({ load: from, steps: 200 });
  assert.equal(fingerprint, execFileSync(NATIVE, { input, encoding: "utf8" }).trim());
  const time = () => firefox.evaluate(() => window.playground.session.clock.time);
  const before = await time();
  await firefox.press("Space");
  await until(async () => (await time()) > before + 0.1, "running");
  await firefox.press("Space");
  assert.deepEqual(await firefox.evaluate(() => window.complaints), [], "the page complains");
  assert.deepEqual(await firefox.inFirefox("return globalThis.asked"), [], "the page asks the network");
});

test("without WebGL 2 the page says so in a sentence", async () => {
  await firefox.open("plane.html", { webgl: false });
  await firefox.screenshot("without-webgl");
  const said = await firefox.evaluate(() => document.querySelector(".failure").innerText);
  assert.equal(
    said,
    "This page needs WebGL 2, which this browser lacks or has switched off; another browser, or its settings for graphics, may have it.",
  );
});
