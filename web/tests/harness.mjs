// What the tests of the page share: a server in a folder of its own, a browser, and their requests.

import { execFileSync, spawn } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import assert from "node:assert/strict";

export const here = dirname(fileURLToPath(import.meta.url));
export const examples = join(here, "../../examples");
export const program = resolve(process.argv[2]);
export const pictures = process.argv[3] ? resolve(process.argv[3]) : "";

export function skip(why) {
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
export const axe = readFileSync(join(here, "../node_modules/axe-core/axe.min.js"), "utf8");

const browsers = [];
export async function launch() {
  const browser = await chromium.launch({
    executablePath: browserFile,
    args: ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
  browsers.push(browser);
  return browser;
}

export const folder = mkdtempSync(join(tmpdir(), "amontons_page_"));
/** A file or folder of the examples, in the tests' folder. */
export const example = (from, to) => cpSync(join(examples, from), join(folder, to), { recursive: true });

const children = [];
export async function serve(...words) {
  const env = { ...process.env };
  delete env.DISPLAY;
  const child = spawn(program, ["studio", ...words], { cwd: folder, env, stdio: ["ignore", "pipe", "ignore"] });
  children.push(child);
  const address = await new Promise((done) => child.stdout.once("data", (d) => done(String(d).trim())));
  return { child, address };
}

/** Of a fresh run of the program: the last value of a column. */
export function freshRun(scene, set, column) {
  const out = execFileSync(
    program,
    ["run", scene, "-o", join(folder, "fresh"), "--json", "--quiet", ...set.map((s) => "--set=" + s)],
    { cwd: folder, encoding: "utf8", maxBuffer: 1 << 26 },
  );
  return JSON.parse(out).quantities[column];
}

export async function open(context, address) {
  const page = await context.newPage();
  page.problems = [];
  page.on("pageerror", (e) => page.problems.push(e.stack));
  page.on("console", (m) => {
    if (m.type() === "error") page.problems.push(m.text());
  });
  await page.goto(address);
  return page;
}

export const newContext = (browser, more = {}) =>
  browser.newContext({ viewport: { width: 1280, height: 800 }, acceptDownloads: true, ...more });

export const button = (page, name) => page.getByRole("button", { name, exact: true });
export const status = (page, text, seconds = 30) =>
  page.waitForFunction((t) => document.querySelector("[role=status]").textContent.startsWith(t), text, {
    timeout: 1000 * seconds,
  });
export const message = (page, text, seconds = 30) =>
  page.getByRole("log").getByText(text).first().waitFor({ timeout: 1000 * seconds });

export async function picture(page, name, part) {
  if (!pictures) return;
  mkdirSync(pictures, { recursive: true });
  await (part ?? page).screenshot({ path: join(pictures, name + ".png") });
}

export async function runUntil(page, time) {
  await button(page, "Run").click();
  await page.waitForFunction((t) => (studio.live.times.at(-1) ?? -1) >= t - 1e-9, time, { timeout: 180000 });
  // A short scene may have reached its end meanwhile.
  await Promise.race([button(page, "Pause").click({ timeout: 60000 }), status(page, "paused", 60)]).catch(() => {});
  await status(page, "paused");
}

export async function toBeginning(page) {
  await button(page, "To the beginning").click();
  await page.waitForFunction(() => studio.live.times.length === 0 && studio.live.moments.length > 0);
}

export async function download(page, name, seconds = 60) {
  const [d] = await Promise.all([
    page.waitForEvent("download", { timeout: 1000 * seconds }),
    button(page, name).click(),
  ]);
  const path = join(folder, d.suggestedFilename());
  await d.saveAs(path);
  return path;
}

export const valueAt = (page, column, time) =>
  page.evaluate(([c, t]) => studio.live.valueAt(c, t), [column, time]);
export const same = (a, b, tolerance) =>
  assert.ok(Math.abs(a - b) <= tolerance * Math.max(Math.abs(a), Math.abs(b)), `${a} and ${b}`);

/** Shares of the pixels in which pictures differ, each from each. */
export function differences(page, urls) {
  return page.evaluate(async (all) => {
    const pixels = await Promise.all(
      all.map(async (u) => {
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
    return all.map((_, i) => all.map((_, j) => share(pixels[i], pixels[j])));
  }, urls);
}

export async function shoot(page) {
  await page.waitForTimeout(300);
  return page.evaluate(() => studio.picture());
}

let failed = 0;
const pattern = process.argv[4] ? new RegExp(process.argv[4]) : null; // for those who write tests
export async function test(name, body, page) {
  if (pattern && !pattern.test(name)) return;
  const begun = Date.now();
  try {
    await body();
    console.log(`ok    ${name} (${((Date.now() - begun) / 1000).toFixed(1)} s)`);
  } catch (error) {
    ++failed;
    console.log(`FAIL  ${name}\n${error.stack}`);
    if (page?.()) await picture(page(), "failed").catch(() => {});
  }
}

export async function finish() {
  for (const c of children) c.kill("SIGKILL");
  for (const b of browsers) await b.close().catch(() => {});
  // Simulations of killed servers end by themselves, and save their state.
  for (let i = 0; i < 50 && existsSync(folder); ++i) {
    try {
      rmSync(folder, { recursive: true, force: true });
    } catch {
      await new Promise((done) => setTimeout(done, 200));
    }
  }
  console.log(failed ? `${failed} failed` : "all passed");
  process.exit(failed ? 1 : 0);
}
