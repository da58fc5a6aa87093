// A scene opened, run, changed, compared, exported: what a user does first.

import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import assert from "node:assert/strict";
import {
  axe,
  button,
  differences,
  download,
  example,
  folder,
  freshRun,
  launch,
  newContext,
  open,
  picture,
  program,
  runUntil,
  same,
  serve,
  shoot,
  status,
  test,
  valueAt,
} from "./harness.mjs";

example("hapco/hexa.json", "hexa.json");
const browser = await launch();
const context = await newContext(browser);
const kForce = "bed_on_tool_force_z";
let page;
let server;

await test("HapCo's scene is opened and run, and its force is that of a run without a page", async () => {
  server = await serve("hexa.json");
  page = await open(context, server.address);
  await status(page, "paused");
  await runUntil(page, 1); // longer than those it is compared with
  same(await valueAt(page, kForce, 0.5), freshRun("hexa.json", ["time.end=0.5"], kForce), 1e-6);
  assert.ok((await page.evaluate(() => studio.frames)) > 2);
});

await test("E and nu are changed by their fields: the force is a fresh run's with them", async () => {
  const before = await valueAt(page, kForce, 0.5);
  const E = page.getByRole("textbox", { name: "bodies.bed.youngs_modulus", exact: true });
  await E.fill("2e5");
  await E.press("Enter");
  await page.waitForFunction(() => studio.valueAt("bodies.bed.youngs_modulus") === 2e5);
  const nu = page.getByRole("textbox", { name: "bodies.bed.poisson_ratio", exact: true });
  await nu.fill("0.4");
  await nu.press("Enter");
  await page.waitForFunction(() => studio.valueAt("bodies.bed.poisson_ratio") === 0.4);
  await button(page, "To the beginning").click();
  await page.waitForFunction(() => studio.live.times.length === 0);
  await runUntil(page, 0.5);
  const now = await valueAt(page, kForce, 0.5);
  same(now, freshRun("hexa.json", ["time.end=0.5", "bodies.bed.youngs_modulus=2e5", "bodies.bed.poisson_ratio=0.4"], kForce), 1e-6);
  assert.ok(Math.abs(now - before) > 0.05 * before, `${now} after ${before}`);
});

await test("a value that a scene cannot have is refused with the reader's message, and undo takes changes back", async () => {
  const nu = page.getByRole("textbox", { name: "bodies.bed.poisson_ratio", exact: true });
  await nu.fill("0.7");
  await nu.press("Enter");
  await page.getByRole("log").getByText(/poisson_ratio.*0\.7.*0\.4999999/).first().waitFor();
  await page.waitForFunction(() => document.querySelector('[data-path="bodies.bed.poisson_ratio"]').value === "0.4");
  await button(page, "Undo").click();
  await page.waitForFunction(() => studio.valueAt("bodies.bed.poisson_ratio") === 0.3);
});

await test("two runs are compared: curves, their difference, two views with one camera", async () => {
  await page.getByRole("combobox", { name: "Compare with" }).selectOption({ label: "run 1" });
  await page.getByRole("img", { name: "View of the run compared with" }).waitFor();
  await page.getByRole("checkbox", { name: "difference" }).check();
  await button(page, "View from +y").click();
  const plot = page.getByRole("region", { name: "First plot" });
  // Every row of the live run is one of the plot, as it came.
  assert.ok(
    await page.evaluate((c) => {
      const f = studio.live.columns.get(c);
      const t = studio.live.times;
      return t.every((x, i) => i === 0 || x > t[i - 1]) && f.every((v, i) => studio.live.valueAt(c, t[i]) === v);
    }, kForce),
  );
  await page.waitForFunction(() => /difference -?\d/.test(document.querySelector(".value").textContent));
  const text = await plot.locator("output").textContent();
  const [a, b, d] = /live (\S+); run 1 (\S+); difference (\S+) N/.exec(text).slice(1).map(Number);
  same(a - b, d, 1e-2);
  assert.ok(Math.abs(d) > 0.05 * Math.abs(b), text);
  await button(page, "View from Isometric").click();
  await page.waitForTimeout(800);
  await picture(page, "studio_compare");
  await page.getByRole("checkbox", { name: "difference" }).uncheck();
  await page.getByRole("combobox", { name: "Compare with" }).selectOption({ label: "nothing" });
});

await test("the pictures of four modes differ, and contact forces can be left out", async () => {
  await page.waitForTimeout(500);
  const shots = new Map();
  for (const mode of ["Normal", "Wire", "Transparent", "X-ray"]) {
    await page.getByRole("radio", { name: mode }).check();
    shots.set(mode, await shoot(page));
    await picture(page, "studio_" + mode.toLowerCase().replace("-", ""), page.getByRole("main"));
  }
  await page.getByRole("radio", { name: "Normal" }).check();
  await page.getByRole("checkbox", { name: "Contact forces" }).uncheck();
  shots.set("no arrows", await shoot(page));
  await page.getByRole("checkbox", { name: "Contact forces" }).check();
  const differ = await differences(page, [...shots.values()]);
  for (let i = 0; i < 4; ++i) for (let j = 0; j < i; ++j) assert.ok(differ[i][j] > 0.05, JSON.stringify(differ));
  assert.ok(differ[4][0] > 0.001 && differ[4][0] < 0.1, JSON.stringify(differ[4]));
});

await test("a set is picked with the mouse, held and freed, and saved with the scene", async () => {
  await button(page, "To the beginning").click();
  await page.waitForFunction(() => studio.live.times.length === 0 && studio.live.moments.length > 0);
  await page.getByText("Sets by picking").click();
  await page.getByRole("combobox", { name: "Pick by" }).selectOption({ label: "a click, and faces like it" });
  await button(page, "View from +x").click();
  await button(page, "Fit the view").click();
  await page.waitForTimeout(500);
  const box = await page.getByRole("img", { name: "View of the scene" }).boundingBox();
  const readout = page.getByLabel("Picked faces");
  for (let y = 0.9; y > 0.5; y -= 0.04) {
    await page.mouse.click(box.x + box.width / 2, box.y + y * box.height);
    await page.waitForTimeout(150);
    if (/of bed/.test(await readout.textContent())) break;
  }
  assert.equal(await readout.textContent(), "64 triangles of bed"); // 8 x 4 cells of the face x_max
  await picture(page, "studio_pick");
  await page.getByRole("textbox", { name: "Name of the set" }).fill("front");
  await button(page, "Make the set").click();
  await page.waitForFunction(() => studio.scene.bodies.bed.sets?.front?.faces_like);
  await page.getByText("Holds", { exact: true }).click();
  await page.getByRole("combobox", { name: "Set of bed" }).selectOption({ label: "front" });
  await button(page, "Hold the set of bed").click();
  await page.waitForFunction(() => studio.scene.bodies.bed.hold.length === 2);
  await page.getByRole("textbox", { name: "File of the scene" }).fill("front.json");
  await button(page, "Save the scene").click();
  await page.getByRole("log").getByText("written: front.json").waitFor();
  execFileSync(program, ["check", "front.json", "--quiet"], { cwd: folder });
  const saved = JSON.parse(readFileSync(join(folder, "front.json"), "utf8"));
  assert.equal(saved.bodies.bed.hold[1].set, "front");
  await runUntil(page, 0.5);
  const held = await valueAt(page, kForce, 0.5);
  same(held, freshRun("front.json", ["time.end=0.5"], kForce), 1e-6);
  await button(page, "Free front of bed").click();
  await button(page, "Start again with it").click();
  await page.waitForFunction(() => studio.scene.bodies.bed.hold.length === 1);
  await button(page, "View from Isometric").click();
});

await test("picture, curve, columns and a page of their own are exported; the page needs no network", async () => {
  await button(page, "To the beginning").click();
  await page.waitForFunction(() => studio.live.times.length === 0);
  await runUntil(page, 0.5);
  assert.equal(readFileSync(await download(page, "Export the view as PNG")).subarray(1, 4).toString(), "PNG");
  const svg = readFileSync(await download(page, "Export the first plot as SVG"), "utf8");
  assert.match(svg, /^<svg .*bed on tool force z \[N\].*<path d="M80\.00 /s);
  assert.doesNotMatch(svg, /NaN/);
  const csv = readFileSync(await download(page, "Export the columns as CSV"), "utf8").trim().split("\n");
  const at = csv[0].split(",").indexOf(kForce + " [N]");
  assert.ok(at > 0, csv[0]);
  same(Number(csv.find((l) => Math.abs(Number(l.split(",")[0]) - 0.5) < 1e-9).split(",")[at]), await valueAt(page, kForce, 0.5), 1e-12);
  const html = await download(page, "Export one HTML file");
  const alone = await browser.newContext({ viewport: { width: 1280, height: 800 }, offline: true });
  const other = await alone.newPage();
  const requests = [];
  other.on("request", (r) => requests.push(r.url()));
  const problems = [];
  other.on("pageerror", (e) => problems.push(e.message));
  await other.goto(pathToFileURL(html).href);
  await other.waitForFunction(() => window.studio?.frames > 0);
  assert.deepEqual(problems, []);
  assert.deepEqual(requests.filter((u) => !u.startsWith("file:") && !u.startsWith("data:") && !u.startsWith("blob:")), []);
  assert.equal(await other.evaluate((c) => studio.shown.valueAt(c, 0.5), kForce), await valueAt(page, kForce, 0.5));
  await alone.close();
});

await test("keys alone run, step and turn the view", async () => {
  await page.locator("body").click({ position: { x: 1000, y: 18 } });
  await page.keyboard.press("Space");
  await status(page, "running");
  await page.keyboard.press("Space");
  await status(page, "paused");
  const rows = await page.evaluate(() => studio.live.times.length);
  await page.keyboard.press(".");
  await page.waitForFunction((n) => studio.live.times.length === n + 1, rows);
  // Every control is reached by Tab, and shows that it is.
  const controls = await page.evaluate(
    () => [...document.querySelectorAll("button, select, input, summary")].filter((e) => !e.disabled && e.offsetParent && e.tabIndex < 0).length,
  );
  assert.equal(controls, 0);
});

await test("axe-core has no serious finding", async () => {
  await page.evaluate(axe);
  const found = await page.evaluate(async () =>
    (await window.axe.run()).violations
      .filter((v) => v.impact === "serious" || v.impact === "critical")
      .map((v) => `${v.id}: ${v.nodes.map((n) => n.target.join(" ")).slice(0, 5).join(", ")}`),
  );
  assert.deepEqual(found, []);
});

await test("a killed simulation is reported within a second and continued", async () => {
  const before = await page.evaluate(() => studio.live.times.at(-1));
  await page.waitForTimeout(500);
  const pid = await page.evaluate(async () =>
    (await (await fetch("/api/state", { headers: { Authorization: "Bearer " + location.hash.slice(1) } })).json()).engine.pid,
  );
  process.kill(pid, "SIGKILL");
  await status(page, "failed", 1);
  await page.getByRole("log").getByText(/signal 9/).first().waitFor();
  await button(page, "Resume").click();
  await status(page, "paused");
  await button(page, "Step").click();
  await page.waitForFunction((t) => studio.live.times.at(-1) > t, before);
  assert.ok((await page.evaluate(() => studio.live.times.at(-1))) < before + 0.06);
});

await test("a finished run is shown step by step", async () => {
  const done = await serve("fresh");
  const results = await open(context, done.address);
  await results.waitForFunction(() => studio.frames > 1 && studio.shown.moments.length > 1);
  const slider = results.getByRole("slider", { name: "Timeline" });
  await slider.focus();
  await results.keyboard.press("End");
  await results.waitForFunction(() => document.querySelector("[aria-label='Time shown']").textContent === "t = 0.5 s");
  await results.waitForTimeout(500);
  await picture(results, "studio_results");
  assert.deepEqual(results.problems, []);
  await results.close();
});

await test("a wire is pushed live by its slider", async () => {
  example("catheter", "catheter");
  const wired = await serve("catheter/scene.json");
  const wire = await open(context, wired.address);
  await status(wire, "paused");
  await button(wire, "Step").click();
  await wire.waitForFunction(() => studio.live.times.length === 1);
  await wire.getByRole("combobox", { name: "Speed" }).selectOption({ label: "real time" });
  const slider = wire.getByRole("slider", { name: /insertion/ }).first();
  const begin = Number(await slider.inputValue());
  await button(wire, "Run").click();
  await slider.focus();
  for (let i = 0; i < 200; ++i) {
    await wire.keyboard.press("ArrowRight");
    await wire.waitForTimeout(20);
  }
  const end = Number(await slider.inputValue());
  assert.ok(end > begin);
  await wire.waitForTimeout(2500);
  await button(wire, "Pause").click();
  await status(wire, "paused");
  const columns = await wire.evaluate(() => Object.fromEntries([...studio.live.columns].map(([n, v]) => [n, v.at(-1)])));
  const name = Object.keys(columns).find((n) => /insertion|inserted|depth/.test(n));
  assert.ok(name, Object.keys(columns).join());
  same(columns[name], end, 1e-6);
  await picture(wire, "studio_catheter");
  assert.deepEqual(wire.problems, []);
  await wire.close();
});

await test("the page reports the end of the server", async () => {
  server.child.kill("SIGKILL");
  await page.getByRole("log").getByText("The server has ended").waitFor({ timeout: 5000 });
  const problems = page.problems.filter((p) => !/ERR_CONNECTION|Failed to load resource|ERR_INCOMPLETE/.test(p));
  assert.deepEqual(problems, []);
});

await browser.close();
