// What is killed, and what is left of it.

import assert from "node:assert/strict";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { button, examples, folder, launch, message, newContext, open, picture, runUntil, serve, status, test } from "./harness.mjs";

// So long that no machine reaches its end before something is killed.
const scene = JSON.parse(readFileSync(join(examples, "hapco/hexa.json"), "utf8"));
scene.time.end = 500;
writeFileSync(join(folder, "lasting.json"), JSON.stringify(scene));
let browser = await launch();
let context = await newContext(browser);
let server = await serve("lasting.json");
let page = await open(context, server.address);
const here = () => page;
await status(page, "paused");

await test("a browser that is killed finds the run again, with what it has done", async () => {
  await runUntil(page, 0.3);
  const before = await page.evaluate(() => [...studio.live.times]);
  await browser.close();
  browser = await launch();
  context = await newContext(browser);
  page = await open(context, server.address);
  await message(page, /was there before the page/);
  assert.deepEqual(await page.evaluate(() => [...studio.live.times]), before);
  await button(page, "Step").click();
  await page.waitForFunction((n) => studio.live.times.length === n + 1, before.length);
}, here);

await test("the results of a live run are those of a run, and are compared like them", async () => {
  const history = readFileSync(join(folder, "out/studio/lasting-001/history.csv"), "utf8").trim().split("\n");
  const rows = await page.evaluate(() => studio.live.times.length);
  assert.equal(history.length - 1, rows);
  await page.getByRole("combobox", { name: "Compare with" }).selectOption("folder:out/studio/lasting-001");
  await page.waitForFunction(() => /difference 0/.test(document.querySelector(".value").textContent));
  await page.getByRole("combobox", { name: "Compare with" }).selectOption({ label: "nothing" });
}, here);

await test("a server that is killed leaves its run, which is continued after a new start", async () => {
  await button(page, "Run").click();
  await page.waitForFunction(() => studio.live.times.at(-1) > 0.33);
  server.child.kill("SIGKILL");
  await message(page, /The server has ended.*out\/studio\/lasting-001/, 5);
  const there = await page.evaluate(() => studio.live.times.length);
  await page.waitForTimeout(1000); // its engine ends, too
  server = await serve();
  page = await open(context, server.address);
  await message(page, /lasting-001 (was cut off|has not reached its end)/);
  await button(page, "Continue it").click();
  await status(page, "paused");
  await button(page, "Step").click();
  await page.waitForFunction(() => studio.live.times.length > 0);
  const history = readFileSync(join(folder, "out/studio/lasting-001/history.csv"), "utf8").trim().split("\n");
  const times = history.slice(1).map((l) => Number(l.split(",")[0]));
  // Rows one after the other without a gap, up to about where it was.
  times.forEach((t, i) => assert.ok(i === 0 || t > times[i - 1]));
  assert.ok(times.length > there - 20, `${times.length} of ${there}`);
  await picture(page, "studio_gone_on_with");
}, here);

await test("without --results nothing is written", async () => {
  const quiet = await serve("lasting.json", "--no-results");
  const other = await open(context, quiet.address);
  await status(other, "paused");
  await button(other, "Step").click();
  await other.waitForFunction(() => studio.live.times.length === 1);
  assert.ok(!existsSync(join(folder, "out/studio/lasting-003")));
  await other.close();
}, here);

await browser.close();
