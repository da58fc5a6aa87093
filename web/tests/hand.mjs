// What is in the hand: a haptic run, and a gamepad.

import assert from "node:assert/strict";
import { button, example, launch, message, newContext, open, picture, serve, status, test } from "./harness.mjs";

example("haptic_bed", "haptic_bed");
example("catheter", "padded");
const browser = await launch();
const context = await newContext(browser);
let page;
const here = () => page;

await test("a run in the hand reports the state of its loop, and is changed while it runs", async () => {
  const server = await serve("haptic_bed/scene.json");
  page = await open(context, server.address);
  await status(page, "paused");
  await page.getByText("In the hand", { exact: true }).click();
  await page.getByRole("checkbox", { name: "Without real time" }).check();
  await button(page, "Start in the hand").click();
  await status(page, "running", 60);
  await page.waitForFunction(() => studio.health && Math.hypot(...studio.health.force) > 0.05, null, { timeout: 120000 });
  const readout = async (name) => page.getByLabel(name, { exact: true }).textContent();
  assert.match(await readout("Rate"), /^\d+ of 1000 Hz$/);
  assert.match(await readout("Missed ticks"), /^0 of \d+, by its own work \d+$/);
  assert.match(await readout("p99 of a tick"), /^\d+ µs$/);
  assert.match(await readout("Energy given to the hand"), /mJ$/);
  assert.match(await readout("State"), /^\w/);
  assert.match(await readout("Force in the hand"), /^[\d.e-]+ N \(/);
  assert.match(await readout("Device from handle"), /^[\d.e-]+ mm$/);
  assert.match(await readout("Simulation's rate"), /^\d+ of 25 steps a second$/);
  // The spring between device and handle carries the force: 800 N/m.
  const h = await page.evaluate(() => studio.health);
  assert.equal(h.rate_aim, 1000);
  assert.ok(h.missed === 0 && h.ticks > 100, JSON.stringify(h));
  assert.ok((await page.evaluate(() => studio.live.columns.get("hand_force")?.length)) > 1);
  await button(page, "Start in the hand").evaluate((e) => e.scrollIntoView({ block: "start" }));
  await picture(page, "studio_hand");
  const E = page.getByRole("textbox", { name: "bodies.bed.youngs_modulus", exact: true });
  await E.fill("3e4");
  await E.press("Enter");
  await message(page, /bodies\.bed\.youngs_modulus=30000(\.0)?: in the hand from t = /, 60);
  await page.waitForFunction(() => studio.valueAt("bodies.bed.youngs_modulus") === 3e4);
  await button(page, "Stop").click();
  await status(page, "stopped");
  assert.deepEqual(page.problems, []);
}, here);

await test("a gamepad moves the inputs that its sticks are assigned to", async () => {
  const server = await serve("padded/scene.json");
  page = await open(context, server.address);
  await status(page, "paused");
  await button(page, "Step").click();
  await page.evaluate(() => {
    navigator.getGamepads = () => [{ connected: true, axes: [0, -1], buttons: [] }];
  });
  const slider = page.getByRole("slider", { name: "wire.insertion" });
  const begin = Number(await slider.inputValue());
  await page.getByRole("combobox", { name: "Gamepad, left stick, up" }).selectOption({ label: "wire.insertion" });
  await page.waitForFunction((x) => Number(document.querySelector('[aria-label="wire.insertion"]').value) > x + 0.01, begin);
  await page.evaluate(() => {
    navigator.getGamepads = () => [{ connected: true, axes: [0.05, 0.05], buttons: [] }]; // released
  });
  await page.waitForTimeout(200);
  const end = Number(await slider.inputValue());
  await page.waitForTimeout(300);
  assert.equal(Number(await slider.inputValue()), end);
  // It is there at the end of a step of the length that is first tried; halved ones take more.
  for (let i = 0; i < 30; ++i) await button(page, "Step").click();
  await page.waitForFunction(() => studio.live.times.length >= 31);
  const inserted = await page.evaluate(() => studio.live.columns.get("insertion")?.at(-1) ?? studio.live.columns.get("depth").at(-1));
  const step = Number(await slider.getAttribute("step")); // the slider shows the nearest of them
  assert.ok(Math.abs(inserted - end) <= 0.5001 * step, `${inserted}, not ${end}`);
  assert.deepEqual(page.problems, []);
}, here);

await browser.close();
