// Sets by every way of picking.

import assert from "node:assert/strict";
import {
  button,
  example,
  launch,
  newContext,
  open,
  picture,
  serve,
  status,
  test,
} from "./harness.mjs";

example("hapco/hexa.json", "picked.json");
const browser = await launch();
const context = await newContext(browser);
const server = await serve("picked.json");
const page = await open(context, server.address);
const here = () => page;
const readout = page.getByLabel("Picked faces");
const pickBy = (label) => page.getByRole("combobox", { name: "Pick by" }).selectOption({ label });
await status(page, "paused");
await page.waitForFunction(() => studio.frames > 0 && studio.live.moments.length > 0);
await page.getByText("Holds", { exact: true }).click();
await page.getByText("Sets by picking").click();
await button(page, "View from +x").click();
await button(page, "Fit the view").click();
await page.waitForTimeout(500);
const view = page.getByRole("img", { name: "View of the scene" });
const box = await view.boundingBox();
/** The face x_max of the bed on the screen. */
const face = await page.evaluate(() => {
  const v = studio.views[0];
  const bed = v.bodyNamed("bed");
  const xs = bed.points.filter((_, i) => i % 3 === 0);
  const most = Math.max(...xs);
  const spots = v.project(bed.points);
  const all = { x0: 1e9, y0: 1e9, x1: -1e9, y1: -1e9 };
  xs.forEach((x, i) => {
    if (x < most - 1e-9) return;
    all.x0 = Math.min(all.x0, spots[2 * i]);
    all.x1 = Math.max(all.x1, spots[2 * i]);
    all.y0 = Math.min(all.y0, spots[2 * i + 1]);
    all.y1 = Math.max(all.y1, spots[2 * i + 1]);
  });
  return all;
});
const drag = async (points) => {
  await page.mouse.move(box.x + points[0][0], box.y + points[0][1]);
  await page.mouse.down();
  for (const [x, y] of points.slice(1)) await page.mouse.move(box.x + x, box.y + y, { steps: 4 });
  await page.mouse.up();
};

async function makeSet(name) {
  await page.getByRole("textbox", { name: "Name of the set" }).fill(name);
  await button(page, "Make the set").click();
  await page.waitForFunction((n) => studio.scene.bodies.bed.sets?.[n], name);
  return page.evaluate((n) => studio.scene.bodies.bed.sets[n], name);
}

/** How many faces the engine has in it. */
async function facesOf(name) {
  const chooser = page.getByRole("combobox", { name: "Show the set" });
  await page.waitForFunction((n) => [...document.querySelectorAll("option")].some((o) => o.value === "bed: " + n), name);
  const text = await chooser.locator("option", { hasText: `bed: ${name} ` }).textContent();
  return Number(/\((\d+) faces\)/.exec(text)[1]);
}

await test("a lasso selects the visible faces in it, and the engine has the same ones", async () => {
  await pickBy("a lasso");
  const m = 6;
  const { x0, y0, x1, y1 } = face;
  await drag([
    [x0 - m, y0 - m],
    [(x0 + x1) / 2 + 4, y0 - m],
    [(x0 + x1) / 2 + 4, y1 + m],
    [x0 - m, y1 + m],
    [x0 - m, y0],
  ]);
  assert.equal(await readout.textContent(), "32 triangles of bed"); // half of 8 x 4 cells
  const set = await makeSet("lassoed");
  assert.equal(set.faces.length, 16);
  assert.equal(await facesOf("lassoed"), 16);
}, here);

await test("a lasso by keys alone", async () => {
  await view.focus();
  const { x0, y0, x1, y1 } = face;
  const cross = { x: box.width / 2, y: box.height / 2 };
  const moveTo = async (x, y) => {
    for (; cross.x > x; cross.x -= 20) await page.keyboard.press("Shift+ArrowLeft");
    for (; cross.x < x; cross.x += 20) await page.keyboard.press("Shift+ArrowRight");
    for (; cross.y > y; cross.y -= 20) await page.keyboard.press("Shift+ArrowUp");
    for (; cross.y < y; cross.y += 20) await page.keyboard.press("Shift+ArrowDown");
    await page.keyboard.press("Enter");
  };
  await moveTo(x0 - 25, y0 - 25);
  await moveTo(x1 + 25, y0 - 25);
  await moveTo(x1 + 25, y1 + 5);
  await moveTo(x0 - 25, y1 + 5);
  await page.keyboard.press(" ");
  assert.equal(await readout.textContent(), "64 triangles of bed");
}, here);

await test("a plane and a box select what lies in them", async () => {
  await pickBy("a click, and its plane");
  await page.mouse.click(box.x + (face.x0 + face.x1) / 2 + 3, box.y + (face.y0 + face.y1) / 2 + 3);
  assert.equal(await readout.textContent(), "64 triangles of bed");
  const plane = await makeSet("in_plane");
  assert.ok(Math.abs(Math.abs(plane.plane.normal[0]) - 1) < 1e-6, JSON.stringify(plane));
  assert.equal(await facesOf("in_plane"), 32);
  await pickBy("a box");
  await drag([
    [face.x0 - 4, face.y0 - 4],
    [face.x1 + 4, face.y1 + 4],
  ]);
  const boxed = await makeSet("boxed");
  assert.ok(boxed.box);
  assert.ok((await facesOf("boxed")) > 32); // all of the bed, seen along x
  await pickBy("nothing");
}, here);

await test("named sets are shown", async () => {
  await button(page, "View from Isometric").click();
  await page.getByRole("combobox", { name: "Show the set" }).selectOption("bed: z_max");
  await page.waitForTimeout(500);
  await picture(page, "studio_set", page.getByRole("main"));
  await page.getByRole("combobox", { name: "Show the set" }).selectOption({ label: "none" });
}, here);

await test("no problem was logged while picking", async () => assert.deepEqual(page.problems, []));
await browser.close();
