/** The replay page in a real browser; `pages.py` made the pages. */

import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { Browser, settled } from "./browser.mjs";
import { compareWithReference } from "./references.mjs";

const OUT = fileURLToPath(new URL("out/", import.meta.url));
let browser;

before(async () => {
  mkdirSync(OUT, { recursive: true });
  browser = await Browser.start();
});
after(() => browser?.close());

/** A test with a page that must neither complain nor ask for anything. */
function withPage(name, file, options, body) {
  test(name, async () => {
    const page = await browser.open(`${OUT}${file}`, options);
    try {
      await body(page);
      assert.deepEqual(page.complaints, [], "the page complains");
      const outside = page.requests.filter((url) => !/^(file|data|blob|about):/.test(url));
      assert.deepEqual(outside, [], "the page asks for something from outside");
      assert.equal(page.requests.filter((url) => url.startsWith("file:")).length, 1, "only the page itself");
    } finally {
      await page.close();
    }
  });
}

/** How many colours the scene has, of every 37th pixel. */
const coloursOfScene = (page) =>
  page.evaluate(() => {
    const source = window.carom.view.stage.canvas;
    const copy = new OffscreenCanvas(source.width, source.height);
    const context = copy.getContext("2d");
    context.drawImage(source, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    const colours = new Set();
    for (let i = 0; i < data.length; i += 4 * 37)
      colours.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
    return colours.size;
  });

/** Where on the page a body or a contact of the scene is. */
const placeOf = (page, what, number) =>
  page.evaluate(
    ([what, number]) => {
      const { view } = window.carom;
      const box = view.stage.canvas.getBoundingClientRect();
      const at = what === "body" ? view.bodyOnScreen(number) : view.contactOnScreen(number);
      return { x: box.left + at.x, y: box.top + at.y };
    },
    [what, number],
  );

const chosen = (page) =>
  page.evaluate(() => {
    const { body, hoveredBodies, hoveredContacts } = window.carom.selection;
    return { body, bodies: [...hoveredBodies], contacts: [...hoveredContacts] };
  });

for (const file of ["plane.html", "space.html", "gallery-plane.html", "gallery-space.html"]) {
  for (const dark of [false, true]) {
    withPage(
      `the scene of ${file} is not blank, ${dark ? "dark" : "light"}`,
      file,
      { dark },
      async (page) => {
        assert.ok((await coloursOfScene(page)) >= 6);
      },
    );
  }
}

withPage("scrubbing moves bodies, plots' cursors and the time", "plane.html", {}, async (page) => {
  const state = () =>
    page.evaluate(() => {
      const { view, plots, clock } = window.carom;
      return { body: view.bodyOnScreen(4), cursor: plots.plots[0].cursorLeft, frame: clock.frame };
    });
  const before = await state();
  await page.locator(".scrubber").fill("60");
  await settled(page);
  const after = await state();
  assert.equal(after.frame, 60);
  assert.ok(Math.abs(after.body.x - before.body.x) > 20, "the disc has rolled");
  assert.ok(after.cursor > before.cursor + 20, "the plots' cursor has moved");
  assert.match(await page.locator(".time").innerText(), /^1\.000 s$/);
});

withPage("keys play, pause, step and jump", "plane.html", {}, async (page) => {
  const frame = () => page.evaluate(() => window.carom.clock.frame);
  await page.keyboard.press("ArrowRight");
  assert.equal(await frame(), 1);
  await page.keyboard.press("Shift+ArrowRight");
  assert.equal(await frame(), 11);
  await page.keyboard.press("ArrowLeft");
  assert.equal(await frame(), 10);
  await page.keyboard.press("End");
  assert.equal(await frame(), 90);
  await page.keyboard.press("Home");
  assert.equal(await frame(), 0);
  await page.keyboard.press("+");
  assert.equal(await page.evaluate(() => window.carom.clock.speed), 2);
  await page.keyboard.press("Space");
  await page.waitForFunction(() => window.carom.clock.frame > 3);
  await page.keyboard.press("Space");
  assert.equal(await page.evaluate(() => window.carom.clock.playing), false);
});

withPage("pointing at a body lights it up, a click opens its panel", "plane.html", {}, async (page) => {
  const at = await placeOf(page, "body", 2);
  await page.mouse.move(at.x, at.y);
  await settled(page);
  assert.deepEqual((await chosen(page)).bodies, [2]);
  assert.equal(await page.locator(".tip").innerText(), "box1");
  await page.mouse.click(at.x, at.y);
  await settled(page);
  assert.equal((await chosen(page)).body, 2);
  assert.match(await page.locator(".body-panel").innerText(), /mass\s+2 kg/);
});

withPage("pointing at a contact lights up it and its two bodies", "plane.html", {}, async (page) => {
  await page.evaluate(() => window.carom.seek(1.4));
  await settled(page);
  const pressing = await page.evaluate(() => {
    const { arrows } = window.carom.view;
    return [...arrows.contacts.normalImpulse].findIndex((impulse) => impulse > 0);
  });
  const at = await placeOf(page, "contact", pressing);
  await page.mouse.move(at.x, at.y);
  await settled(page);
  const found = await chosen(page);
  assert.equal(found.contacts.length, 1);
  assert.equal(found.bodies.length, 2);
  assert.match(await page.locator(".tip").innerText(), /normal .* N s/);
});

withPage("matrix and scene point at each other", "plane.html", {}, async (page) => {
  await page.evaluate(() => window.carom.seek(1.4));
  await page.getByRole("tab", { name: "Matrix" }).click();
  await settled(page);
  const entry = await page.evaluate(() => window.carom.matrix.placeOf(0, 1));
  await page.mouse.move(entry.x, entry.y);
  await settled(page);
  const found = await chosen(page);
  assert.deepEqual(found.contacts, [0, 1]);
  assert.ok(found.bodies.length >= 1);
  assert.match(await page.locator(".matrix-panel .told").innerText(), /share .*: A = .* 1\/kg/);
  const marked = () =>
    page.evaluate(() => {
      const marks = document.querySelector(".marks");
      const copy = new OffscreenCanvas(marks.width, marks.height).getContext("2d");
      copy.drawImage(marks, 0, 0);
      const { data } = copy.getImageData(0, 0, marks.width, marks.height);
      return data.some((value) => value > 0);
    });
  assert.ok(await marked());
  const at = await placeOf(page, "body", 1);
  await page.mouse.move(at.x, at.y);
  await settled(page);
  assert.deepEqual((await chosen(page)).bodies, [1]);
  assert.ok(await marked(), "rows of the body's contacts are marked");
});

withPage(
  "plots tell values with units under the pointer, and a click jumps",
  "plane.html",
  {},
  async (page) => {
    const chart = page.locator('[data-chart="Energy"] .u-over');
    const box = await chart.boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await settled(page);
    assert.match(await page.locator('[data-chart="Energy"] .readout').innerText(), /kinetic\s+.* J/);
    assert.ok(
      await page.locator('[data-chart="Residual"] .readout.hovered').count(),
      "all charts follow the pointer",
    );
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    const time = await page.evaluate(() => window.carom.clock.time);
    assert.ok(Math.abs(time - 0.75) < 0.05, `the middle is at 0.75 s, not ${time} s`);
  },
);

withPage("the certificate tells the step shown and the worst step", "plane.html", {}, async (page) => {
  await page.evaluate(() => window.carom.seek(0.5));
  await page.getByRole("tab", { name: "Certificate" }).click();
  const text = await page.locator(".certificate").innerText();
  assert.match(text, /off the laws of contact by .* m\/s/);
  assert.match(text, /positions\s+rounded by at most .* m/);
});

withPage(
  "steps of frames are explained, and contacts coloured by their residual",
  "told.html",
  {},
  async (page) => {
    await page.getByRole("tab", { name: "Certificate" }).click();
    const why = [];
    for (const time of [0.1, 0.4]) {
      await page.evaluate((t) => window.carom.seek(t), time);
      await settled(page);
      why.push(await page.locator(".certificate > div").first().innerText());
      assert.match(why.at(-1), /Why\s[\s\S]*accurate: the contact problem[\s\S]*residual of the natural map/);
    }
    assert.notEqual(why[0], why[1]);
    const residuals = await page.evaluate(() => {
      const [replay] = window.carom.replays;
      return Array.from(replay.contacts(replay.frames - 1).residual);
    });
    assert.ok(residuals.length > 0 && residuals.every((r) => r >= 0 && r < 1), residuals.join());
    await page.locator("summary", { hasText: "Contacts" }).click();
    await page.getByLabel("colour of contacts").selectOption("residual");
    assert.match(await page.locator(".legend").innerText(), /within .* m\/s[\s\S]*not known/);
  },
);

withPage("the camera follows the chosen body", "plane.html", {}, async (page) => {
  const place = (time) =>
    page.evaluate((t) => {
      window.carom.seek(t);
      const { x, y } = window.carom.view.bodyOnScreen(4);
      return [x, y];
    }, time);
  await page.evaluate(() => window.carom.selection.choose(4));
  const [begin] = [await place(0)];
  const free = await place(1.2);
  assert.ok(Math.abs(free[0] - begin[0]) > 20, "the disc rolls over the screen");
  await page.keyboard.press("f");
  const held = [await place(0), await place(1.2)];
  assert.ok(
    Math.hypot(held[1][0] - held[0][0], held[1][1] - held[0][1]) < 1,
    "and stands still when followed",
  );
});

withPage("contacts are coloured by what they do and by island", "plane.html", {}, async (page) => {
  await page.evaluate(() => window.carom.seek(1.4));
  await page.locator("summary", { hasText: "Contacts" }).click();
  const legend = page.locator(".legend");
  assert.match(await legend.innerText(), /sticks\s+slips\s+strikes\s+takes off/);
  const picture = () => page.evaluate(() => window.carom.view.stage.canvas.toDataURL());
  const byStatus = await picture();
  await page.getByLabel("colour of contacts").selectOption("island");
  await settled(page);
  assert.match(await legend.innerText(), /island/);
  assert.notEqual(await picture(), byStatus);
});

withPage("bodies that sleep are dimmed, and wake", "sleepers.html", {}, async (page) => {
  const state = (time) =>
    page.evaluate((t) => {
      window.carom.seek(t);
      const { bodies, replay } = window.carom.view;
      const who = new Uint8Array(replay.bodies);
      replay.sleepers(window.carom.clock.frame, who);
      const colours = bodies.batches.flatMap(({ bodies: drawn, fill }) =>
        [...drawn].map((body, i) => [body, [...fill.instanceColor.array.slice(3 * i, 3 * i + 3)].join()]),
      );
      return { who: [...who], colours: Object.fromEntries(colours) };
    }, time);
  const before = await state(0);
  assert.deepEqual(before.who, [0, 0, 0, 0, 0, 0], "nobody sleeps at the beginning");
  const resting = await state(1.2);
  assert.deepEqual(resting.who, [0, 1, 1, 1, 1, 0], "boxes sleep, floor and ball do not");
  for (const body of [1, 2, 3, 4]) assert.notEqual(resting.colours[body], before.colours[body]);
  for (const body of [0, 5]) assert.equal(resting.colours[body], before.colours[body]);
  await page.evaluate(() => window.carom.selection.choose(1));
  await page.getByRole("tab", { name: "Body" }).click();
  assert.match(await page.locator(".body-panel").innerText(), /asleep/);
  const struck = await state(1.9);
  assert.equal(struck.who[1], 0, "the ball woke the box that it struck");
  await page.evaluate(() => window.carom.selection.choose(-1));
  await settled(page);
  assert.equal((await state(1.9)).colours[1], before.colours[1]);
});

withPage("names of bodies are text and nothing else", "hostile.html", {}, async (page) => {
  assert.equal(await page.evaluate(() => window.broken), undefined);
  const names = await page.evaluate(() => window.carom.replays[0].names);
  assert.equal(names[1], "</script><script>window.broken = 1</script>");
  await page.evaluate(() => window.carom.selection.choose(2));
  assert.equal(await page.evaluate(() => window.broken), undefined);
  assert.match(await page.locator(".body-panel select").innerText(), /Körper ☃/);
});

withPage("two runs are shown as ghosts, side by side and alone", "two.html", {}, async (page) => {
  assert.equal(await page.locator(".plot h3").first().innerText(), "Distance between the runs m");
  for (const how of ["ghosts", "beside", "first", "second"]) {
    await page.locator("header select").selectOption(how);
    await settled(page);
    assert.ok((await coloursOfScene(page)) >= 5, how);
    const stands = await page.evaluate(() => {
      const { bodies, other } = window.carom.view;
      return [bodies, other].map(({ obstacles }) => obstacles.children.length > 0);
    });
    assert.deepEqual(stands, [true, true], "both runs have their floor");
  }
});

/** Labels of a chart's axes, and how far the last of its time axis stands from its canvas's right edge [px]. */
const axesOf = (page, chart) =>
  page.evaluate((name) => {
    const { plot: u } = window.carom.plots.plots.find((plot) => plot.chart.name === name);
    const context = new OffscreenCanvas(9, 9).getContext("2d");
    const [times, values] = u.axes.map((axis) => axis._values.map((text) => text ?? ""));
    context.font = "11px ui-sans-serif, system-ui, sans-serif";
    const last = times.length - 1;
    const right = u.bbox.left / devicePixelRatio + u.valToPos(u.axes[0]._splits[last], "x");
    const room = u.width - right - context.measureText(times[last]).width / 2;
    return { times, values: values.filter(Boolean), room };
  }, chart);

withPage(
  "charts stay where they are while the run plays and the pointer reads them",
  "bounces.html",
  {},
  async (page) => {
    const tops = () =>
      page.evaluate(() => {
        const { top } = document.querySelector(".plots").getBoundingClientRect();
        return [...document.querySelectorAll(".plot")]
          .map((plot) => plot.getBoundingClientRect().top - top)
          .join();
      });
    const before = await tops();
    for (const share of [0.1, 0.25, 0.5, 0.8, 1]) {
      await page.evaluate((part) => window.carom.seek(part * window.carom.clock.times.at(-1)), share);
      await settled(page);
      assert.equal(await tops(), before, `at ${share} of the run`);
    }
    const box = await page.locator('[data-chart="Energy"] .u-over').boundingBox();
    for (const share of [0.02, 0.3, 0.97]) {
      await page.mouse.move(box.x + share * box.width, box.y + box.height / 2);
      await settled(page);
      assert.equal(await tops(), before, "under the pointer");
      assert.match(await page.locator('[data-chart="Residual"] .readout').innerText(), /residual\s*[0-9]/);
    }
  },
);

withPage(
  "a residual with none beside it is drawn, and one of zero is told",
  "blows.html",
  {},
  async (page) => {
    const found = await page.evaluate(() => {
      const { plot: u, chart } = window.carom.plots.plots.find((plot) => plot.chart.name === "Residual");
      const drawn = new OffscreenCanvas(u.ctx.canvas.width, u.ctx.canvas.height).getContext("2d", {
        willReadFrequently: true,
      });
      drawn.drawImage(u.ctx.canvas, 0, 0);
      const [line] = chart.lines;
      const values = [...line.values];
      const has = (i) => values[i] !== null && values[i] !== undefined;
      const alone = values.map((_, i) => i).filter((i) => has(i) && !has(i - 1) && !has(i + 1));
      const ink = (i) => {
        const [x, y] = [u.valToPos(chart.time[i], "x", true), u.valToPos(values[i], "y", true)];
        const { data } = drawn.getImageData(Math.round(x) - 1, Math.round(y) - 1, 3, 3);
        return data.filter((value, k) => k % 4 === 3 && value > 200).length;
      };
      const zero = [...line.told].indexOf(0);
      return { alone: alone.map(ink), zero, time: chart.time[zero] };
    });
    assert.ok(found.alone.length > 0, "the run has such residuals");
    assert.ok(
      found.alone.every((pixels) => pixels >= 4),
      found.alone.join(),
    );
    assert.ok(found.zero >= 0, "and zeros");
    await page.evaluate((time) => window.carom.seek(time), found.time);
    await settled(page);
    assert.match(await page.locator('[data-chart="Residual"] .readout').innerText(), /residual\s*0 m\/s/);
  },
);

withPage("axes have labels that can be read", "bounces.html", {}, async (page) => {
  const { values } = await axesOf(page, "Residual");
  assert.ok(values.length >= 2 && values.every((text) => text.startsWith("10")), values.join());
  for (const name of ["Energy", "Work by cause", "Closure of the books", "Momentum", "Deepest overlap"]) {
    const { values: labels } = await axesOf(page, name);
    assert.ok(labels.length >= 2, `${name}: ${labels.join()}`);
  }
  for (const name of ["Energy", "Residual", "Contacts"]) {
    const { room, times } = await axesOf(page, name);
    assert.ok(room >= 0, `${name}: ${times.at(-1)} ends ${-room} pixels beyond the chart`);
  }
});

withPage("a chart of nothing but zeros has no other label", "alone.html", {}, async (page) => {
  assert.deepEqual((await axesOf(page, "Contacts")).values, ["0"]);
  assert.match(await page.locator("header .told").innerText(), /^1 body /);
});

withPage(
  "of two runs every line is plotted, under names that tell them apart",
  "tolerances.html",
  {},
  async (page) => {
    const names = await page.evaluate(() =>
      Object.fromEntries(
        window.carom.plots.plots.map(({ chart }) => [chart.name, chart.lines.map(({ name }) => name)]),
      ),
    );
    for (const [chart, lines] of Object.entries(names)) {
      if (chart === "Distance between the runs") continue;
      const first = lines.filter((line) => !line.endsWith("(2)"));
      for (const line of first) assert.ok(lines.includes(`${line} (2)`), `${chart}: ${lines.join()}`);
    }
    assert.ok(names.Residual.includes("tolerance (2)"), names.Residual.join());
    const options = await page.locator("header select").innerText();
    assert.match(options, /1: tolerance [^\n]*\n1: tolerance[^\n]*\n2: tolerance 0\.001/s);
    const gaps = await page.evaluate(
      () => getComputedStyle(document.querySelector(".mark.dashes")).backgroundImage,
    );
    assert.match(gaps, /repeating-linear-gradient/);
  },
);

withPage("runs that are equal are told to be 0 apart", "same.html", {}, async (page) => {
  const distance = page.locator('[data-chart="Distance between the runs"] .readout');
  assert.match(await distance.innerText(), /largest\s*0 m\s*mean\s*0 m/);
  assert.match(await page.locator("header select").innerText(), /2: the same settings/);
});

withPage("a click on a body of the second run tells of that run", "two.html", {}, async (page) => {
  await page.evaluate(() => window.carom.seek(1.4));
  const differs = await page.evaluate(() => {
    const at = (run) => {
      const [replay, frame] = [window.carom.replays[run], window.carom.replays[run].frameAt(1.4)];
      const into = new Float64Array(3);
      replay.position(frame, 4, into);
      return [...into];
    };
    return [at(0), at(1)];
  });
  assert.ok(Math.hypot(differs[0][0] - differs[1][0], differs[0][1] - differs[1][1]) > 1e-3, "they differ");
  for (const [how, run] of [
    ["second", 1],
    ["first", 0],
    ["beside", 1],
  ]) {
    await page.locator("header select").selectOption(how);
    await settled(page);
    const at = await page.evaluate(
      ([x, y, right]) => {
        const { stage } = window.carom.view;
        const box = stage.canvas.getBoundingClientRect();
        const place = stage.toScreen(stage.controls.target.clone().set(x, y, 0));
        return [box.left + place.x + (right ? box.width / 2 : 0), box.top + place.y];
      },
      [...differs[run].slice(0, 2), how === "beside"],
    );
    await page.evaluate(() => window.carom.selection.choose(-1, 0));
    await page.mouse.click(...at);
    await settled(page);
    const { body, run: told } = await page.evaluate(() => window.carom.selection);
    assert.deepEqual([body, told], [4, run], how);
    const shown = await page.locator(".body-panel").innerText();
    const x = differs[run][0].toPrecision(4).replace("-", "−");
    assert.ok(shown.includes(`(${x.replace(/\.?0+$/, "")}`), `${how}: ${x} in ${shown}`);
    const drawn = await page.evaluate(() => {
      const { arrows, otherArrows } = window.carom.view;
      return [arrows.group.visible, otherArrows.group.visible];
    });
    if (how !== "beside") assert.deepEqual(drawn, [run === 0, run === 1], "contacts of that run are drawn");
  }
});

for (const [file, below] of [
  ["bounces.html", [0, -0.5, 0]],
  ["far.html", [0, 0, -0.02]],
]) {
  withPage(`a floor is drawn under the scene wherever its own place is: ${file}`, file, {}, async (page) => {
    const met = await page.evaluate((at) => {
      const { stage, bodies } = window.carom.view;
      const place = stage.toScreen(stage.controls.target.clone().set(...at));
      const box = stage.canvas.getBoundingClientRect();
      const around = [-250, 0, 250].map((by) =>
        bodies.pick(stage.rayAt(box.left + place.x + by, box.top + place.y)),
      );
      return around.filter((body) => body === 0).length;
    }, below);
    assert.ok(met >= 2, `${met} of three places beside the ball show the floor`);
  });
}

withPage("a floor goes along with the camera", "plane.html", {}, async (page) => {
  const met = await page.evaluate(() => {
    const { stage, bodies } = window.carom.view;
    const by = stage.controls.target.clone().set(5000, 0, 0);
    stage.shift(by);
    stage.camera.zoom = 0.002;
    stage.camera.updateProjectionMatrix();
    stage.drawFull();
    const place = stage.toScreen(by.set(6200, -200, 0));
    const box = stage.canvas.getBoundingClientRect();
    return bodies.pick(stage.rayAt(box.left + place.x, box.top + place.y));
  });
  assert.equal(met, 0);
});

withPage(
  "arrows of a body at rest are seen beside the blows of another",
  "bounces.html",
  {},
  async (page) => {
    const lengths = await page.evaluate(() => {
      const { view, clock, replays } = window.carom;
      const found = { resting: [], longest: 0, unit: view.arrows.unit };
      const begin = view.arrows.shafts.instanceMatrix;
      for (let frame = 1; frame < clock.frames; frame++) {
        const contacts = replays[0].contacts(frame);
        view.arrows.show(frame, [], []);
        const { array } = begin;
        const heads = view.arrows.heads.instanceMatrix.array;
        for (let i = 0; i < contacts.count; i++) {
          const length =
            Math.hypot(...array.slice(16 * i + 4, 16 * i + 7)) +
            Math.hypot(...heads.slice(16 * i + 4, 16 * i + 7));
          found.longest = Math.max(found.longest, length);
          if (contacts.a[i] === 2 || contacts.b[i] === 2) found.resting.push(length);
        }
      }
      return found;
    });
    const { unit, resting, longest } = lengths;
    resting.sort((a, b) => a - b);
    const usual = resting[resting.length >> 1];
    assert.ok(usual > 0.3 * unit && usual < 1.5 * unit, `${usual} m where an arrow has ${unit} m`);
    assert.ok(longest <= 3.01 * unit, `${longest} m`);
  },
);

withPage("a belt's length is not that of a usual body", "belt.html", {}, async (page) => {
  const usual = await page.evaluate(() => window.carom.view.usual);
  assert.ok(Math.abs(usual - 0.5) < 1e-9, `${usual} m`);
});

for (const file of ["plane.html", "space.html", "two.html"]) {
  withPage(`the worst step is the one that is shown when asked for: ${file}`, file, {}, async (page) => {
    await page.getByRole("tab", { name: "Certificate" }).click();
    const worst = await page.evaluate(() => window.carom.replays.map(({ table }) => table.worst.step + 1));
    const between = await page.evaluate(() => window.carom.replays[0].table.worst.step % 4 !== 3);
    for (const [run, step] of worst.entries()) {
      await page.getByRole("button", { name: "show the worst step" }).nth(run).click();
      await settled(page);
      const told = await page.locator(".certificate > div").nth(run).innerText();
      assert.ok(told.startsWith(`Step ${step},`), told);
      if (run === 0 && between) assert.match(told, /The scene shows the frame nearest to it/);
    }
    await page.evaluate(() => window.carom.clock.show(3));
    await page.evaluate(() => window.carom.tabs.refresh());
    assert.match(await page.locator(".certificate > div").first().innerText(), /^Step 12,/);
  });
}

withPage(
  "soft steps are not blamed for iterations that they do not have",
  "sleepers.html",
  {},
  async (page) => {
    await page.getByRole("tab", { name: "Certificate" }).click();
    await page.evaluate(() => window.carom.seek(1));
    const text = await page.locator(".certificate").innerText();
    assert.match(text, /soft springs/);
    assert.doesNotMatch(text, /iterations|the scheme's own/);
    assert.doesNotMatch(await page.locator("header .told").innerText(), /undefined|null/);
  },
);

withPage("the solver that a scheme chose has its name", "plane.html", {}, async (page) => {
  await page.getByRole("tab", { name: "Certificate" }).click();
  assert.match(await page.locator(".certificate").innerText(), /solver\s+nncg\s+impact law\s+newton/);
});

withPage("a slider keeps its keys, and the page has the others", "plane.html", {}, async (page) => {
  await page.locator("summary", { hasText: "Contacts" }).click();
  const slider = page.getByLabel("length of arrows");
  await slider.focus();
  await page.keyboard.press("ArrowRight");
  assert.equal(await slider.inputValue(), "0.1");
  assert.equal(await page.evaluate(() => window.carom.clock.frame), 0);
  await page.keyboard.press("Space");
  await page.waitForFunction(() => window.carom.clock.frame > 1);
});

withPage("any of 10,000 bodies is found by its name", "many.html", {}, async (page) => {
  await page.getByRole("tab", { name: "Body" }).click();
  const field = page.locator(".body-panel input");
  await field.fill("body999");
  assert.ok((await page.locator(".body-panel datalist option").count()) >= 10);
  await field.fill("body9998");
  assert.equal((await chosen(page)).body, 9999);
  await field.fill("nobody");
  await field.press("Enter");
  assert.ok(await page.locator(".body-panel input.wrong").count(), "a name that nobody has is marked");
});

withPage("bodies that a joint joins are of one island", "jointed.html", {}, async (page) => {
  await page.evaluate(() => window.carom.seek(0.2));
  await page.locator("summary", { hasText: "Contacts" }).click();
  await page.getByLabel("colour of contacts").selectOption("island");
  await settled(page);
  const colours = await page.evaluate(() => {
    const { contacts, points } = window.carom.view.arrows;
    const found = {};
    for (let i = 0; i < contacts.count; i++) {
      const body = Math.max(contacts.a[i], contacts.b[i]);
      found[body] = [...points.instanceColor.array.slice(3 * i, 3 * i + 3)].join();
    }
    return found;
  });
  assert.equal(colours[1], colours[2]);
  assert.notEqual(colours[1], colours[3]);
});

withPage("a speed has its unit", "plane.html", {}, async (page) => {
  await page.evaluate(() => window.carom.selection.choose(4));
  assert.match(await page.locator(".body-panel").innerText(), /velocity\s+\(.*\) m\/s, speed 2 m\/s/);
});

withPage(
  "on a phone nothing is wider than the screen",
  "space.html",
  { width: 390, height: 844 },
  async (page) => {
    const widths = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(widths[0] <= widths[1], `${widths[0]} > ${widths[1]} pixels`);
    await page.evaluate(() => window.carom.seek(0.6));
    assert.ok((await coloursOfScene(page)) >= 6);
  },
);

withPage(
  "10,000 bodies are drawn, roughly while time moves and in full when it stops",
  "many.html",
  {},
  async (page) => {
    const state = () =>
      page.evaluate(() => {
        const { stage, bodies } = window.carom.view;
        const corners = bodies.batches.map(({ fill }) => fill?.geometry.getAttribute("position").count ?? 0);
        return { coarse: stage.coarse, corners: Math.max(...corners), width: stage.canvas.width };
      });
    await page.evaluate(async () => {
      for (let frame = 1; frame < 4; frame++) {
        window.carom.clock.show(frame);
        await new Promise((done) => requestAnimationFrame(done));
      }
    });
    const moving = await state();
    assert.ok(moving.coarse, "coarse while time moves");
    await page.waitForFunction(() => !window.carom.view.stage.coarse, null, { timeout: 30_000 });
    const still = await state();
    assert.ok(still.corners > moving.corners, `${still.corners} corners, ${moving.corners} while time moves`);
    assert.ok(still.width > moving.width);
    assert.ok((await coloursOfScene(page)) >= 6);
  },
);

test("on a phone two fingers zoom and one scrubs", async () => {
  const phone = {
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
    deviceScaleFactor: 2,
  };
  const device = await Browser.start(phone);
  try {
    const page = await device.open(`${OUT}space.html`, { width: 390, height: 844 });
    const session = await page.context().newCDPSession(page);
    const touch = async (type, ...points) => {
      await session.send("Input.dispatchTouchEvent", {
        type,
        touchPoints: points.map(([x, y], id) => ({ x, y, id })),
      });
      await settled(page);
    };
    const scene = await page.locator(".scene canvas").boundingBox();
    const [x, y] = [scene.x + scene.width / 2, scene.y + scene.height / 2];
    const scale = () => page.evaluate(() => window.carom.view.stage.scale());
    const before = await scale();
    await touch("touchStart", [x - 30, y], [x + 30, y]);
    for (const half of [45, 60, 75, 90]) await touch("touchMove", [x - half, y], [x + half, y]);
    await touch("touchEnd");
    assert.ok((await scale()) < 0.7 * before, "the scene is nearer");
    assert.equal(await page.evaluate(() => window.visualViewport.scale), 1, "the page itself has not grown");
    const slider = await page.locator(".scrubber").boundingBox();
    const middle = slider.y + slider.height / 2;
    await touch("touchStart", [slider.x + 8, middle]);
    for (const share of [0.2, 0.4, 0.6]) await touch("touchMove", [slider.x + share * slider.width, middle]);
    await touch("touchEnd");
    const [frame, frames] = await page.evaluate(() => [window.carom.clock.frame, window.carom.clock.frames]);
    assert.ok(Math.abs(frame / frames - 0.6) < 0.1, `frame ${frame} of ${frames}`);
    assert.deepEqual(page.complaints, []);
  } finally {
    await device.close();
  }
});

test("a notebook that was run shows the replay after nbconvert", async () => {
  const page = await browser.context.newPage();
  const asked = [];
  page.on("request", (request) => asked.push([request.frame(), request.url()]));
  await page.goto(`file://${OUT}notebook.html`);
  const frame = page.frames().find((one) => one.url() === "about:srcdoc");
  await frame.waitForFunction(() => window.carom);
  assert.equal(await frame.evaluate(() => window.carom.replays[0].names[1]), "box0");
  await settled(frame);
  assert.ok((await coloursOfScene(frame)) >= 4, "the scene is not blank");
  const outside = asked.filter(([one, url]) => one === frame && !/^(data|blob|about):/.test(url));
  assert.deepEqual(outside, [], "the replay asks for something from outside");
  await page.close();
});

for (const [name, file, time, dark, before] of [
  ["plane", "plane.html", 1.0, false],
  ["plane-dark", "plane.html", 1.0, true],
  ["space", "space.html", 0.5, false],
  ["space-dark", "space.html", 0.5, true],
  ["gallery-plane", "gallery-plane.html", 0.0, false],
  ["gallery-space", "gallery-space.html", 0.0, false],
  ["ghosts", "two.html", 1.4, false],
  ["beside", "two.html", 1.4, false, () => window.carom.view.setCompare("beside")],
]) {
  withPage(`the picture ${name} is as it was`, file, { width: 480, height: 300, dark }, async (page) => {
    await page.evaluate(() => window.carom.showSceneOnly(true));
    if (before) await page.evaluate(before);
    await page.evaluate((at) => window.carom.seek(at), time);
    await settled(page);
    await compareWithReference(page, name);
  });
}
