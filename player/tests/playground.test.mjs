/**
 * The playground in a real browser: the same bits as a native build, dragging, sliders, links, refusals. Skipped, loudly,
 * where the page could not be built.
 */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { Browser } from "./browser.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const ROOT = join(HERE, "../..");
const PAGE = join(HERE, "../dist-playground/playground.html");
const NATIVE = process.env.CAROM_NATIVE ?? join(ROOT, "target/debug/examples/fingerprint");
const READY = existsSync(PAGE);
if (READY && !existsSync(NATIVE)) throw new Error(`${NATIVE} is not there: make test-player builds it`);
const options = { skip: READY ? false : "the playground is not built: make playground" };

const text = (name) => readFileSync(join(ROOT, name), "utf8");
const FILES = ["first_steps_planar", "first_steps_spatial", "seven_objects_from_file"].map((name) =>
  text(`python/carom/scenes/${name}.toml`),
);
const SCATTERED = JSON.stringify({
  schema_version: 1,
  space: "planar",
  body: [
    { name: "floor", kind: "static", shape: { type: "half_plane", normal: [0, 1] } },
    {
      name: "box",
      shape: { type: "box", size: [0.4, 0.3] },
      density: 10,
      position: [0, 1],
      repeat: {
        count: [3, 4],
        step: [
          [0.6, 0],
          [0, 0.6],
        ],
      },
      scatter: { position: [0.05, 0.02], rotation: 0.5, seed: 3 },
    },
  ],
});
const BOUNCING = {
  schema_version: 1,
  space: "spatial",
  world: { impact: "moreau" },
  body: [
    { name: "floor", kind: "static", shape: { type: "half_space", normal: [0, 0, 1] }, restitution: 0.5 },
    { name: "box", shape: { type: "box", size: [1, 2, 3] }, density: 10, position: [0, 0, 4] },
  ],
};
const SCENE_OF_MESHES = join(ROOT, "python/carom/scenes/meshes_on_terrain.toml");
const MESHES = ["terrain.ply", "gear.obj", "nut.stl", "pawn.ply", "bracket.obj", "mug.glb", "rock.stl"].map(
  (name) => join(ROOT, "python/carom/scenes/meshes", name),
);
const SCENES = ["pyramid_small_planar", "seven_objects", "billiard_break_spatial", "double_pendulum_planar"];
/** Steps that the same bits are asked for, whatever registers a machine has. */
const EXACTLY = [
  [{ scheme: "soft_step", solver: null, impact: null }, 200],
  [{ scheme: "fixed_step", solver: "pgs" }, 150],
  [{ scheme: "fixed_step", solver: "nncg" }, 150],
  [{ scheme: "fixed_step", solver: "sequential" }, 100],
  [{ scheme: "fixed_step", solver: "apgd", impact: "poisson" }, 60],
];

let browser;
let page;

before(async () => {
  if (!READY) {
    console.error(`=== SKIPPED: ${options.skip} ===`);
    return;
  }
  browser = await Browser.start();
  page = await opened("");
});
after(() => browser?.close());

/** The playground at an address that ends in `hash`. */
async function opened(hash) {
  const made = await browser.context.newPage();
  made.requests = [];
  made.complaints = [];
  made.on("request", (request) => made.requests.push(request.url()));
  made.on("pageerror", (error) => made.complaints.push(String(error)));
  made.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) made.complaints.push(message.text());
  });
  await made.goto(pathToFileURL(PAGE).href + hash);
  await made.waitForFunction(() => window.playground || window.caromError, null, { timeout: 60_000 });
  assert.equal(await made.evaluate(() => window.caromError), undefined);
  return made;
}

const load = (state) => page.evaluate((s) => window.playground.load(s), state);
const run = (count) => page.evaluate((n) => window.playground.run(n), count);
const fingerprint = () => page.evaluate(() => window.playground.fingerprint());
const complaint = () => page.evaluate(() => document.querySelector(".complaint.wrong")?.textContent ?? "");

test("the same scene gives the same bits in the page and in a native build", options, async () => {
  const loads = [...FILES.map((file) => ({ text: file })), ...SCENES.map((name) => ({ name }))];
  const asked = loads.flatMap((from) =>
    EXACTLY.map(([settings, steps]) => ({ load: { ...from, settings }, steps })),
  );
  for (const steps of [1, 90]) asked.push({ load: { text: JSON.stringify(BOUNCING) }, steps });
  const input = asked.map((each) => JSON.stringify(each)).join("\n");
  const native = execFileSync(NATIVE, { input, encoding: "utf8" }).trim().split("\n");
  for (const [i, { load: from, steps }] of asked.entries()) {
    assert.equal(await load(from), true);
    await run(steps);
    const told = await complaint(); // soft steps hold no joints: both say so, in the same words
    assert.equal(
      told ? `refused: ${told}` : await fingerprint(),
      native[i],
      JSON.stringify(asked[i]).slice(0, 300),
    );
  }
});

test(
  "every scene of the list gives the same bits in the page and in a native build, as it is",
  options,
  async () => {
    const names = await page.evaluate(() =>
      [...document.querySelectorAll("header optgroup:not([label='with a text']) option")].map(
        ({ value }) => value,
      ),
    );
    assert.ok(names.length > 30, names.join());
    const asked = names.map((name) => JSON.stringify({ load: { name }, steps: 12 })).join("\n");
    const native = execFileSync(NATIVE, { input: asked, encoding: "utf8" }).trim().split("\n");
    for (const [i, name] of names.entries()) {
      assert.equal(await load({ name }), true);
      await run(12);
      assert.equal(await fingerprint(), native[i], name);
    }
  },
);

test("scene files read in the page give the bits that Python's reader gives", options, async (t) => {
  const python = process.env.CAROM_PYTHON ?? join(ROOT, ".venv/bin/python");
  if (!existsSync(python)) return t.skip("no Python environment here: make test-python");
  const asked = [...FILES, SCATTERED].flatMap((file) => [
    { load: { text: file, settings: { scheme: "fixed_step" } }, steps: 0 },
    { load: { text: file, settings: { scheme: "fixed_step" } }, steps: 60 },
    { load: { text: file, settings: { scheme: "soft_step" } }, steps: 60 },
  ]);
  const input = asked.map((each) => JSON.stringify(each)).join("\n");
  const program = join(HERE, "fingerprints.py");
  const native = execFileSync(python, [program], { input, encoding: "utf8" }).trim().split("\n");
  for (const [i, { load: from, steps }] of asked.entries()) {
    assert.equal(await load(from), true);
    await run(steps);
    assert.equal(await fingerprint(), native[i], JSON.stringify(asked[i]).slice(0, 200));
  }
});

/** Gives files to the page as its dialogue does. */
async function give(...files) {
  await page.getByRole("tab", { name: "Scene file" }).click();
  await page.evaluate(() => {
    window.opening = new Promise((done) => {
      const { opened } = window.playground;
      window.playground.opened = (given) => {
        window.playground.opened = opened;
        return opened.call(window.playground, given).then(done);
      };
    });
  });
  await page.locator("input[type=file]").setInputFiles(files);
  await page.evaluate(() =>
    Promise.race([
      window.opening,
      new Promise((_, fail) =>
        setTimeout(() => fail(new Error("the page took no notice of the files")), 60_000),
      ),
    ]),
  );
}

test("mesh files that a scene names are given beside it, or named as missing", options, async () => {
  await load({ text: FILES[1] });
  const there = await fingerprint();
  await give(SCENE_OF_MESHES);
  assert.match(await complaint(), /'meshes\/bracket\.obj'.*'meshes\/mug\.glb'.*'meshes\/terrain\.ply'.*drop/);
  assert.equal(await fingerprint(), there, "what ran before goes on");
  await give(...MESHES.slice(1));
  assert.match(await complaint(), /to find 'meshes\/terrain\.ply' in/);
  await give(MESHES[0]);
  assert.equal(await complaint(), "");
  assert.equal(await page.evaluate(() => window.playground.session.live.names.length), 37);
  // the link holds the meshes too
  const link = await page.evaluate(() => window.playground.link());
  const begun = await fingerprint();
  const other = await opened(new URL(link).hash);
  assert.equal(await other.evaluate(() => window.playground.fingerprint()), begun);
  await other.close();
  await run(5);
  assert.notEqual(await fingerprint(), begun);
  assert.equal(await complaint(), "");
  // a file that the scene does not name, one that is broken, and a scene together with its meshes
  await give({
    name: "spare.obj",
    mimeType: "",
    buffer: Buffer.from("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
  });
  assert.match(await page.locator(".complaint").innerText(), /names no mesh 'spare\.obj'/);
  await give({ name: "broken.stl", mimeType: "", buffer: Buffer.from([1, 2, 3]) });
  assert.match(await complaint(), /mesh 'broken\.stl'.*STL/);
  await give(SCENE_OF_MESHES, ...MESHES);
  assert.equal(await fingerprint(), begun);
});

test("a scene of meshes gives the same bits in the page and in a native build", options, async () => {
  await give(SCENE_OF_MESHES, ...MESHES);
  const { text: read, meshes } = await page.evaluate(() => window.playground.state);
  const asked = [
    { load: { text: read, meshes, settings: { scheme: "soft_step" } }, steps: 60 },
    { load: { text: read, meshes, settings: { scheme: "fixed_step", solver: "pgs" } }, steps: 60 },
  ];
  const input = asked.map((each) => JSON.stringify(each)).join("\n");
  const native = execFileSync(NATIVE, { input, encoding: "utf8" }).trim().split("\n");
  for (const [i, { load: from, steps }] of asked.entries()) {
    assert.equal(await load(from), true);
    await run(steps);
    assert.equal(await fingerprint(), native[i], JSON.stringify(from.settings));
  }
});

test("meshes read in the page are the bodies that Python makes of them", options, async (t) => {
  const python = process.env.CAROM_PYTHON ?? join(ROOT, ".venv/bin/python");
  if (!existsSync(python)) return t.skip("no Python environment here: make test-python");
  await give(SCENE_OF_MESHES, ...MESHES);
  const about = await page.evaluate(() => window.playground.session.live.about);
  const input = JSON.stringify({ load: { name: "meshes_on_terrain" }, bodies: true });
  const told = JSON.parse(execFileSync(python, [join(HERE, "fingerprints.py")], { input, encoding: "utf8" }));
  assert.equal(told.length, about.names.length);
  const close = (one, other, what) =>
    assert.ok(
      Math.abs(one - other) <= 1e-9 * Math.max(1e-3, Math.abs(other)),
      `${what}: ${one}, not ${other}`,
    );
  const same = (one, other, what) => {
    if (typeof other === "number") return close(one, other, what);
    if (typeof other !== "object") return assert.equal(one, other, what);
    assert.deepEqual(Object.keys(one).sort(), Object.keys(other).sort(), what);
    for (const key of Object.keys(other)) same(one[key], other[key], `${what}.${key}`);
  };
  told.forEach(({ inverse_mass, center, trace, shape }, i) => {
    const name = about.names[i];
    close(about.inverse_mass[i], inverse_mass, `inverse mass of ${name}`);
    close(
      about.inverse_inertia[i].slice(0, 3).reduce((a, b) => a + b),
      trace,
      `inverse inertia of ${name}`,
    );
    for (let k = 0; k < 3; k++) close(about.center[3 * i + k], center[k], `centre of ${name}`);
    same(about.shapes[about.shape[i]], shape, `shape of ${name}`);
  });
});

test("dragging lifts a body, and the books have the work", options, async () => {
  await load({ text: FILES[0] });
  const body = await page.evaluate(() => {
    const { session } = window.playground;
    return session.live.names.indexOf("box 0 in layer 3");
  });
  const at = await page.evaluate((i) => {
    const box = window.playground.session.view.stage.canvas.getBoundingClientRect();
    const { x, y } = window.playground.session.view.bodyOnScreen(i);
    return { x: box.left + x, y: box.top + y };
  }, body);
  const height = () =>
    page.evaluate((i) => {
      const into = new Float64Array(3);
      window.playground.session.live.position(0, i, into);
      return into[1];
    }, body);
  const before = await height();
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x, at.y - 120, { steps: 6 });
  await page.waitForFunction(
    ([i, low]) => {
      const into = new Float64Array(3);
      window.playground.session.live.position(0, i, into);
      return into[1] > low + 0.3;
    },
    [body, before],
    { timeout: 20_000 },
  );
  await page.mouse.up();
  await page.evaluate(() => window.playground.session.clock.pause());
  const { applied, closure, energy } = await page.evaluate(() => {
    const { live } = window.playground.session;
    const last = live.steps.column("ledger_applied");
    return { applied: last[last.length - 1], ...live.books };
  });
  assert.ok(applied > 100, `work of the hand ${applied} J`);
  assert.ok(Math.abs(closure) < 1e-9 * energy, `the books close to ${closure} J`);
});

test("sliders and choices change what is computed", options, async () => {
  await load({ text: FILES[0] });
  await run(60);
  const plain = await fingerprint();
  await load({ text: FILES[0] });
  const slide = (name, value) =>
    page.evaluate(
      ([control, to]) => {
        const found = document.querySelector(`[data-control="${control}"]`);
        found.value = to;
        found.dispatchEvent(new Event(found.tagName === "SELECT" ? "change" : "input"));
      },
      [name, value],
    );
  await slide("friction", "0");
  await slide("dt", "-2");
  await slide("iterations", "1");
  await slide("scheme", "soft_step");
  const { settings } = await page.evaluate(() => window.playground.session.live.about);
  assert.deepEqual([settings.dt, settings.iterations, settings.scheme], [0.01, 10, "soft_step"]);
  await run(60);
  assert.notEqual(await fingerprint(), plain);
  assert.equal(await complaint(), "");
});

test("bodies that rest fall asleep where that is asked for, and are told", options, async () => {
  await load({ text: FILES[0], settings: { scheme: "fixed_step" } });
  const box = page.locator('[data-control="sleeping"]');
  await page.getByRole("tab", { name: "Controls" }).click();
  assert.ok(await box.isDisabled(), "soft steps alone put bodies to sleep");
  await page.locator('[data-control="scheme"]').selectOption("soft_step");
  await run(900);
  const figures = () => page.locator("output.figures").innerText();
  const choices = () => page.evaluate(() => window.playground.session.live.about.settings.soft);
  assert.doesNotMatch(await figures(), /asleep/);
  const awake = await choices();
  assert.equal(awake.sleeping, false);
  assert.ok(awake.substeps > 0, "what is compared below is there");
  await box.check();
  assert.equal(await complaint(), "");
  assert.deepEqual(await choices(), { ...awake, sleeping: true }, "the other choices stay");
  await run(900);
  const asleep = await page.evaluate(() => window.playground.session.live.asleep);
  assert.ok(asleep >= 10, `${asleep} asleep`);
  await page.waitForFunction(() => /1\d asleep/.test(document.querySelector("output.figures").textContent));
  await box.uncheck();
  await run(1);
  assert.equal(await page.evaluate(() => window.playground.session.live.asleep), 0);
});

test("on a phone nothing is wider than the screen, and a finger drags a body", options, async () => {
  const phone = await Browser.start({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  try {
    const made = await phone.context.newPage();
    await made.goto(pathToFileURL(PAGE).href);
    await made.waitForFunction(() => window.playground || window.caromError, null, { timeout: 60_000 });
    const widths = await made.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(widths[0] <= widths[1], `${widths[0]} > ${widths[1]} pixels`);
    const { body, x, y } = await made.evaluate(() => {
      const { view, live } = window.playground.session;
      const box = view.stage.canvas.getBoundingClientRect();
      const body = live.names.indexOf("box 0 in layer 3");
      const at = view.bodyOnScreen(body);
      return { body, x: box.left + at.x, y: box.top + at.y };
    });
    const height = () =>
      made.evaluate((i) => {
        const into = new Float64Array(3);
        window.playground.session.live.position(0, i, into);
        return into[1];
      }, body);
    const before = await height();
    const session = await made.context().newCDPSession(made);
    const touch = (type, ...points) =>
      session.send("Input.dispatchTouchEvent", {
        type,
        touchPoints: points.map(([px, py]) => ({ x: px, y: py })),
      });
    await touch("touchStart", [x, y]);
    for (const up of [20, 40, 60]) await touch("touchMove", [x, y - up]);
    for (let i = 0; i < 100 && (await height()) < before + 0.3; i++) await made.waitForTimeout(100);
    await touch("touchEnd");
    assert.ok((await height()) > before + 0.3, `from ${before} m to ${await height()} m`);
  } finally {
    await phone.close();
  }
});

test(
  "figures of a scene that stands are those of its last step, however quickly it came",
  options,
  async () => {
    await load({ text: FILES[0] });
    await page.evaluate(async () => {
      for (let i = 0; i < 7; i++) {
        document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true }));
        await new Promise((next) => requestAnimationFrame(() => requestAnimationFrame(next)));
      }
    });
    await page.waitForFunction(
      () => {
        const { clock, live } = window.playground.session;
        const told = document.querySelector("output.figures").textContent;
        return live.taken === 7 && !clock.playing && told.startsWith(`${live.time[0].toFixed(3)} s`);
      },
      undefined,
      { timeout: 30_000 },
    );
  },
);

test("a link brings the state back, bit for bit, and it goes on the same", options, async () => {
  for (const steps of [0, 40]) {
    await load({ text: FILES[0], settings: { scheme: "soft_step" } });
    await run(steps);
    const link = await page.evaluate(() => window.playground.link());
    const there = await fingerprint();
    await run(40);
    const later = await fingerprint();
    const other = await opened(new URL(link).hash);
    assert.equal(await other.evaluate(() => window.playground.fingerprint()), there);
    await other.evaluate(() => window.playground.run(40));
    assert.equal(await other.evaluate(() => window.playground.fingerprint()), later);
    await other.close();
  }
});

test(
  "a link of a run brings back what the sliders of coefficients show, and what the scene had",
  options,
  async () => {
    await load({ text: FILES[0] });
    const slider = () => page.locator("[data-control=friction]");
    await page.evaluate(() => window.playground.coefficients(0.35, null));
    await run(40);
    const hash = await page.evaluate(async () => (await window.playground.link()).split("#")[1]);
    const own = await page.evaluate(() =>
      window.playground.session.live.about.own.map(([friction]) => friction),
    );
    const other = await opened(`#${hash}`);
    const state = () =>
      other.evaluate(() => ({
        told: document.querySelector("[data-control=friction]").parentElement.querySelector("output").value,
        value: Number(document.querySelector("[data-control=friction]").value),
        own: window.playground.session.live.about.own.map(([friction]) => friction),
      }));
    assert.deepEqual(await state(), { told: "0.35", value: 0.35, own });
    assert.equal(await slider().count(), 1);
    // the scene's own coefficients are there again: both go on in the same way
    for (const each of [page, other]) {
      await each.evaluate(() => window.playground.coefficients(null, null));
      await each.evaluate(() => window.playground.run(40));
    }
    assert.equal(await other.evaluate(() => window.playground.fingerprint()), await fingerprint());
    await other.close();
  },
);

test("what rolls away stays in the picture, until the camera is moved", options, async () => {
  await load({ name: "rolling_ball_planar" });
  const ball = () =>
    page.evaluate(() => {
      const { view } = window.playground.session;
      const box = view.stage.canvas.getBoundingClientRect();
      return view.bodyOnScreen(1).x / box.width;
    });
  await run(150);
  await page.waitForTimeout(600);
  const share = await ball();
  assert.ok(share > 0 && share < 1, `at ${share} of the width`);
  const middle = await page.evaluate(() => {
    const box = window.playground.session.view.stage.canvas.getBoundingClientRect();
    return [box.left + box.width / 2, box.top + box.height / 3];
  });
  await page.mouse.move(...middle);
  await page.mouse.wheel(0, -400);
  const zoom = () => page.evaluate(() => window.playground.session.view.stage.scale());
  const own = await zoom();
  await run(300);
  await page.waitForTimeout(600);
  assert.equal(await zoom(), own, "the reader's camera is left alone");
});

test("keys work after a click on a control", options, async () => {
  await load({ text: FILES[0] });
  await page.locator("[data-control=friction]").click();
  await page.locator("[data-control=scheme]").press("Tab");
  await page.locator("[data-control=dt]").focus();
  const playing = () => page.evaluate(() => window.playground.session.clock.playing);
  assert.equal(await playing(), false);
  await page.keyboard.press("Space");
  assert.equal(await playing(), true);
  await page.keyboard.press("Space");
  assert.equal(await playing(), false);
  const before = await page.evaluate(() => window.playground.session.live.about.settings.dt);
  await page.keyboard.press("ArrowRight");
  const after = await page.evaluate(() => window.playground.session.live.about.settings.dt);
  assert.notEqual(after, before, "a slider keeps its arrows");
});

test("the list names the scene that runs, and none where it is a user's own", options, async () => {
  const named = () => page.locator("select[aria-label=scene]").inputValue();
  await load({ name: "card_house" });
  assert.equal(await named(), "card_house");
  await load({ text: FILES[0] });
  assert.equal(await named(), "");
  await page.locator("select[aria-label=scene]").selectOption("first_steps_planar");
  assert.equal(await page.evaluate(() => window.playground.session.live.names.length), 12);
  assert.equal(await load({ name: "nobody" }), false);
  assert.equal(await named(), "first_steps_planar");
});

test("what cannot be read is told, and the scene goes on", options, async () => {
  await load({ text: FILES[0] });
  await run(10);
  const there = await fingerprint();
  const body = (more) => ({ ...BOUNCING, body: [{ name: "odd", mass: 1, ...more }] });
  for (const [scene, told] of [
    ["schema_version = 1\nspace = ", /TOML/],
    ["{", /JSON/],
    [JSON.stringify(body({ shape: { type: "egg" } })), /odd.*egg/],
    [JSON.stringify(body({ frction: 1 })), /odd.*frction/],
    [JSON.stringify(body({ friction: "much" })), /odd.*friction.*much/],
    [JSON.stringify(body({ mesh: { file: "a.obj", as: "hull" } })), /mesh.*'a\.obj'.*drop/],
    [JSON.stringify({ ...BOUNCING, world: { dt: -1 } }), /dt/],
  ]) {
    assert.equal(await load({ text: scene }), false);
    assert.match(await complaint(), told);
    assert.equal(await fingerprint(), there);
  }
  await run(1);
  assert.notEqual(await fingerprint(), there);
  const damaged = await opened("#s=nonsense");
  assert.match(await damaged.evaluate(() => document.querySelector(".complaint").textContent), /damaged/);
  assert.ok(await damaged.evaluate(() => window.playground.session !== undefined));
  await damaged.close();
});

test("nothing is asked of another host, nothing is complained of", options, () => {
  assert.deepEqual(
    page.requests.filter(
      (url) => !url.startsWith("file:") && !url.startsWith("data:") && !url.startsWith("blob:"),
    ),
    [],
  );
  assert.deepEqual(page.complaints, []);
});
