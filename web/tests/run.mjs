// The page of amontons studio in a real browser, driven by roles and labels.
//
// usage: node run.mjs PROGRAM [FOLDER OF PICTURES]
//
// Exit code 77 (skipped) where Chromium or playwright-core is missing.

import { execFileSync, spawn } from "node:child_process";
import { copyFileSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import assert from "node:assert/strict";

const here = dirname(fileURLToPath(import.meta.url));
const program = resolve(process.argv[2]);
const pictures = process.argv[3] ? resolve(process.argv[3]) : "";

function skip(why) {
  console.log("skipped: " + why);
  process.exit(77);
}

const browserFile = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
if (!browserFile) skip("no chromium");
let chromium;
try {
  ({ chromium } = await import("playwright-core"));
} catch {
  skip("no web/node_modules/playwright-core (cd web && npm ci --ignore-scripts)");
}
const axe = readFileSync(join(here, "../node_modules/axe-core/axe.min.js"), "utf8");

const folder = mkdtempSync(join(tmpdir(), "amontons_page_"));
const examples = join(here, "../../examples");
copyFileSync(join(examples, "hapco/hexa.json"), join(folder, "hexa.json"));

const children = [];
async function serve(scene, ...more) {
  const env = { ...process.env };
  delete env.DISPLAY;
  const child = spawn(program, ["studio", scene, ...more], { cwd: folder, env, stdio: ["ignore", "pipe", "ignore"] });
  children.push(child);
  const address = await new Promise((done) => child.stdout.once("data", (d) => done(String(d).trim())));
  return { child, address };
}

/** Of a fresh run of the program: the last value of a column. */
function freshRun(scene, set, column) {
  const out = execFileSync(
    program,
    ["run", scene, "-o", join(folder, "fresh"), "--json", "--quiet", ...set.map((s) => "--set=" + s)],
    { cwd: folder, encoding: "utf8", maxBuffer: 1 << 26 },
  );
  return JSON.parse(out).quantities[column];
}

const browser = await chromium.launch({
  executablePath: browserFile,
  args: ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, acceptDownloads: true });

async function open(address) {
  const page = await context.newPage();
  page.problems = [];
  page.on("pageerror", (e) => page.problems.push(e.stack));
  page.on("console", (m) => {
    if (m.type() === "error") page.problems.push(m.text());
  });
  await page.goto(address);
  return page;
}

const button = (page, name) => page.getByRole("button", { name, exact: true });
const status = (page, text, seconds = 30) =>
  page.waitForFunction((t) => document.querySelector("[role=status]").textContent.startsWith(t), text, { timeout: 1000 * seconds });

async function picture(page, name, part) {
  if (!pictures) return;
  mkdirSync(pictures, { recursive: true });
  await (part ?? page).screenshot({ path: join(pictures, name + ".png") });
}

async function runUntil(page, time) {
  await button(page, "Run").click();
  await page.waitForFunction((t) => (studio.live.times.at(-1) ?? -1) >= t - 1e-9, time, { timeout: 180000 });
  if (await button(page, "Pause").isEnabled()) await button(page, "Pause").click();
  await status(page, "paused");
}

const valueAt = (page, column, time) => page.evaluate(([c, t]) => studio.live.valueAt(c, t), [column, time]);
const kForce = "bed_on_tool_force_z";
const same = (a, b, tolerance) => assert.ok(Math.abs(a - b) <= tolerance * Math.max(Math.abs(a), Math.abs(b)), `${a} and ${b}`);

let failed = 0;
async function test(name, body) {
  const begun = Date.now();
  try {
    await body();
    console.log(`ok    ${name} (${((Date.now() - begun) / 1000).toFixed(1)} s)`);
  } catch (error) {
    ++failed;
    console.log(`FAIL  ${name}\n${error.stack}`);
    if (pictures && context.pages().length) await picture(context.pages()[0], "failed");
  }
}

let page;
let server;

await test("HapCo's scene is opened and run, and its force is that of a run without a page", async () => {
  server = await serve("hexa.json");
  page = await open(server.address);
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

await test("a value that a scene cannot have is refused with the reader's words, and undo takes changes back", async () => {
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

await test("four modes look different, and contact forces can be left out", async () => {
  await page.waitForTimeout(500);
  const shots = new Map();
  const shoot = async () => {
    await page.waitForTimeout(400);
    return page.evaluate(() => studio.picture());
  };
  for (const mode of ["Normal", "Wire", "Transparent", "X-ray"]) {
    await page.getByRole("radio", { name: mode }).check();
    shots.set(mode, await shoot());
    await picture(page, "studio_" + mode.toLowerCase().replace("-", ""), page.getByRole("main"));
  }
  await page.getByRole("radio", { name: "Normal" }).check();
  await page.getByRole("checkbox", { name: "Contact forces" }).uncheck();
  shots.set("no arrows", await shoot());
  await page.getByRole("checkbox", { name: "Contact forces" }).check();
  const differ = await page.evaluate(async (urls) => {
    const pixels = await Promise.all(
      urls.map(async (u) => {
        const image = new Image();
        image.src = u;
        await image.decode();
        const c = document.createElement("canvas");
        c.width = image.width;
        c.height = image.height;
        const g = c.getContext("2d");
        g.drawImage(image, 0, 0);
        return g.getImageData(0, 0, c.width, c.height).data;
      }),
    );
    const share = (a, b) => {
      let n = 0;
      for (let i = 0; i < a.length; i += 4)
        if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) > 30) ++n;
      return (4 * n) / a.length;
    };
    return urls.map((_, i) => urls.map((_, j) => share(pixels[i], pixels[j])));
  }, [...shots.values()]);
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
  const told = page.getByLabel("Picked faces");
  for (let y = 0.9; y > 0.5; y -= 0.04) {
    await page.mouse.click(box.x + box.width / 2, box.y + y * box.height);
    await page.waitForTimeout(150);
    if (/of bed/.test(await told.textContent())) break;
  }
  assert.equal(await told.textContent(), "64 triangles of bed"); // 8 x 4 cells of the face x_max
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

await test("picture, curve, columns and a page of their own leave it; the page needs no network", async () => {
  await button(page, "To the beginning").click();
  await page.waitForFunction(() => studio.live.times.length === 0);
  await runUntil(page, 0.5);
  const download = async (name) => {
    const [d] = await Promise.all([page.waitForEvent("download"), button(page, name).click()]);
    const path = join(folder, d.suggestedFilename());
    await d.saveAs(path);
    return path;
  };
  assert.equal(readFileSync(await download("Export the view as PNG")).subarray(1, 4).toString(), "PNG");
  const svg = readFileSync(await download("Export the first plot as SVG"), "utf8");
  assert.match(svg, /^<svg .*bed on tool force z \[N\].*<path d="M80\.00 /s);
  assert.doesNotMatch(svg, /NaN/);
  const csv = readFileSync(await download("Export the columns as CSV"), "utf8").trim().split("\n");
  const at = csv[0].split(",").indexOf(kForce + " [N]");
  assert.ok(at > 0, csv[0]);
  same(Number(csv.find((l) => Math.abs(Number(l.split(",")[0]) - 0.5) < 1e-9).split(",")[at]), await valueAt(page, kForce, 0.5), 1e-12);
  const html = await download("Export one HTML file");
  const alone = await browser.newContext({ viewport: { width: 1280, height: 800 }, offline: true });
  const other = await alone.newPage();
  const asked = [];
  other.on("request", (r) => asked.push(r.url()));
  const problems = [];
  other.on("pageerror", (e) => problems.push(e.message));
  await other.goto(pathToFileURL(html).href);
  await other.waitForFunction(() => window.studio?.frames > 0);
  assert.deepEqual(problems, []);
  assert.deepEqual(asked.filter((u) => !u.startsWith("file:") && !u.startsWith("data:") && !u.startsWith("blob:")), []);
  assert.equal(await other.evaluate((c) => studio.shown.valueAt(c, 0.5), kForce), await valueAt(page, kForce, 0.5));
  await alone.close();
});

await test("keys alone run, step and look", async () => {
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

await test("a killed simulation is told within a second and gone on with", async () => {
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

await test("a finished run is looked at, step by step", async () => {
  const done = await serve("fresh");
  const results = await open(done.address);
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
  for (const f of ["catheter/scene.json", "catheter/aorta.csv"]) if (existsSync(join(examples, f))) copyFileSync(join(examples, f), join(folder, f.split("/")[1]));
  const wired = await serve("scene.json");
  const wire = await open(wired.address);
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

await test("the page says so when the server ends", async () => {
  server.child.kill("SIGKILL");
  await page.getByRole("log").getByText("The server has ended").waitFor({ timeout: 5000 });
  const problems = page.problems.filter((p) => !/ERR_CONNECTION|Failed to load resource|ERR_INCOMPLETE/.test(p));
  assert.deepEqual(problems, []);
});

for (const c of children) c.kill("SIGKILL");
await browser.close();
rmSync(folder, { recursive: true });
console.log(failed ? `${failed} failed` : "all passed");
process.exit(failed ? 1 : 0);
