// Views: two of them, a cut, distances, arrows, X-ray, film.

import { execFileSync } from "node:child_process";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { join, dirname } from "node:path";
import assert from "node:assert/strict";
import {
  button,
  differences,
  download,
  example,
  folder,
  launch,
  newContext,
  open,
  picture,
  program,
  runUntil,
  serve,
  shoot,
  status,
  test,
} from "./harness.mjs";

example("hapco/hexa.json", "looked_at.json");
const browser = await launch();
const context = await newContext(browser);
const server = await serve("looked_at.json");
const page = await open(context, server.address);
const here = () => page;
await status(page, "paused");
await runUntil(page, 0.6);

await test("two views of one run have one camera and modes of their own", async () => {
  await page.getByRole("combobox", { name: "Views" }).selectOption({ label: "two side by side" });
  await page.getByRole("img", { name: "Second view of the scene" }).waitFor();
  await page.getByRole("combobox", { name: "Mode of the second view" }).selectOption({ label: "Wire" });
  await page.getByRole("combobox", { name: "Colour of the second view" }).selectOption({ label: "distance moved" });
  await button(page, "View from +y").click();
  await page.waitForTimeout(600);
  const cameras = await page.evaluate(() => studio.views.map((v) => JSON.stringify(v.getCamera())));
  assert.equal(cameras[0], cameras[1]);
  await button(page, "View from Isometric").click();
  await page.waitForTimeout(600);
  await picture(page, "studio_two_views");
  await page.getByRole("combobox", { name: "Views" }).selectOption({ label: "one" });
}, here);

await test("a cutting plane shows the inside full, from either side", async () => {
  const whole = await shoot(page);
  await page.getByRole("combobox", { name: "Cutting plane" }).selectOption({ label: "across y" });
  const slider = page.getByRole("slider", { name: "Cutting plane along the axis" });
  await slider.focus();
  for (let i = 0; i < 20; ++i) await page.keyboard.press("ArrowLeft");
  assert.match(await page.getByLabel("Place of the cutting plane").textContent(), /^y = -0\.00\d+ m$/);
  const cut = await shoot(page);
  await picture(page, "studio_cut", page.getByRole("main"));
  await page.getByRole("checkbox", { name: "Keep the other side" }).check();
  const other = await shoot(page);
  const differ = await differences(page, [whole, cut, other]);
  assert.ok(differ[0][1] > 0.02 && differ[1][2] > 0.02, JSON.stringify(differ));
  await page.getByRole("checkbox", { name: "Keep the other side" }).uncheck();
  await page.getByRole("combobox", { name: "Cutting plane" }).selectOption({ label: "none" });
}, here);

await test("a distance is measured by the mouse and by keys, and moves with the bodies", async () => {
  await button(page, "View from -y").click();
  await button(page, "Fit the view").click();
  await page.getByText("Distances", { exact: true }).click();
  await page.getByRole("checkbox", { name: "Measure a distance" }).check();
  const box = await page.getByRole("img", { name: "View of the scene" }).boundingBox();
  const readout = page.getByLabel("Measured distance");
  const at = async (x, y) => page.mouse.click(box.x + x * box.width, box.y + y * box.height);
  await at(0.35, 0.75);
  await at(0.65, 0.75);
  const metre = await page.evaluate(() => {
    const c = studio.views[0].camera;
    return studio.views[0].element.clientHeight / ((c.top - c.bottom) / c.zoom);
  });
  const expected = (0.3 * box.width) / metre;
  const read = async () => {
    const text = await readout.textContent();
    const [, number, unit] = /^([\d.]+) (\S+) \(/.exec(text) ?? assert.fail(text);
    return Number(number) * { mm: 1e-3, µm: 1e-6, m: 1 }[unit];
  };
  assert.ok(Math.abs((await read()) - expected) < 0.02 * expected, `${await readout.textContent()}, not ${expected}`);
  await picture(page, "studio_distance", page.getByRole("main"));
  await page.getByRole("img", { name: "View of the scene" }).focus();
  for (let i = 0; i < 6; ++i) await page.keyboard.press("Shift+ArrowDown"); // from the tool to the bed
  await page.keyboard.press("Enter"); // begins anew
  for (let i = 0; i < 10; ++i) await page.keyboard.press("Shift+ArrowRight");
  await page.keyboard.press("Enter");
  const keys = 200 / metre;
  assert.ok(Math.abs((await read()) - keys) < 0.02 * keys, `${await readout.textContent()}, not ${keys}`);
  await page.getByRole("checkbox", { name: "Measure a distance" }).uncheck();
}, here);

await test("arrows are of the whole force or a part, on either body, joined or not", async () => {
  await button(page, "View from Isometric").click();
  const shots = [await shoot(page)];
  await page.getByRole("combobox", { name: "Part of the forces" }).selectOption({ label: "friction" });
  shots.push(await shoot(page));
  await page.getByRole("combobox", { name: "Part of the forces" }).selectOption({ label: "whole force" });
  await page.getByRole("checkbox", { name: "On the other body" }).check();
  shots.push(await shoot(page));
  await page.getByRole("textbox", { name: "Join within" }).fill("0.02");
  await page.getByRole("textbox", { name: "Join within" }).press("Enter");
  shots.push(await shoot(page));
  await picture(page, "studio_joined", page.getByRole("main"));
  const differ = await differences(page, shots);
  for (let i = 0; i < 4; ++i) for (let j = 0; j < i; ++j) assert.ok(differ[i][j] > 0.001, JSON.stringify(differ));
  await page.getByRole("textbox", { name: "Join within" }).fill("0");
  await page.getByRole("textbox", { name: "Join within" }).press("Enter");
  await page.getByRole("checkbox", { name: "On the other body" }).uncheck();
}, here);

await test("the page exports a film that a browser plays", async () => {
  const path = await download(page, "Export a film", 180);
  const bytes = readFileSync(path);
  assert.deepEqual([...bytes.subarray(0, 4)], [0x1a, 0x45, 0xdf, 0xa3]);
  const count = await page.evaluate(() => studio.live.moments.length);
  const player = await context.newPage(); // the page itself permits no film
  const played = await player.evaluate(async (base64) => {
    const video = document.createElement("video");
    video.muted = true;
    video.src = URL.createObjectURL(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: "video/webm" }));
    await new Promise((done, wrong) => {
      video.onloadeddata = done;
      video.onerror = () => wrong(new Error(video.error.message));
    });
    const { duration, videoWidth, videoHeight } = video;
    video.playbackRate = 4;
    await video.play();
    await new Promise((done) => (video.onended = done));
    return { duration, videoWidth, videoHeight };
  }, bytes.toString("base64"));
  await player.close();
  assert.ok(Math.abs(played.duration - count / 25) < 0.05, JSON.stringify(played) + count);
  const size = await page.evaluate(() => [studio.views[0].canvas.width, studio.views[0].canvas.height]);
  assert.deepEqual([played.videoWidth, played.videoHeight], size.map((n) => n - (n % 2)));
}, here);

const python = "/usr/bin/python3";
const packages = join(dirname(program), "../lib/python3/site-packages");
const hasPackage = existsSync(join(packages, "amontons"));

await test("the X-ray view of a wire is that of the Python package" + (hasPackage ? "" : " (skipped: it was not built)"), async () => {
  if (!hasPackage) return;
  example("catheter", "xrayed");
  const wired = await serve("xrayed/scene.json");
  const wire = await open(context, wired.address);
  await status(wire, "paused");
  await runUntil(wire, 8);
  await wire.getByRole("radio", { name: "X-ray" }).check();
  await wire.getByRole("checkbox", { name: "Vessels and solids, too" }).uncheck();
  await wire.getByRole("textbox", { name: "C-arm angle" }).fill("20");
  await wire.getByRole("textbox", { name: "C-arm angle" }).press("Enter");
  await wire.waitForTimeout(800);
  const seen = await wire.evaluate(() => {
    const v = studio.views[0];
    const camera = v.getCamera();
    v.drawNow(true);
    const c = document.createElement("canvas");
    c.width = v.canvas.width;
    c.height = v.canvas.height;
    const g = c.getContext("2d");
    g.drawImage(v.canvas, 0, 0); // without what is written over it
    const grey = g.getImageData(0, 0, c.width, c.height).data.filter((_, i) => i % 4 === 0);
    const body = studio.shown.moments.at(-1).instant.bodies.find((b) => b.kind === "wire");
    const wide = (v.camera.right - v.camera.left) / v.camera.zoom;
    return {
      grey: [...grey],
      size: [c.height, c.width],
      width: wide,
      target: camera.target.toArray(),
      way: camera.position.sub(camera.target).normalize().toArray(),
      up: camera.up.toArray(),
      line: [...body.points],
      radius: [...body.radius],
    };
  });
  writeFileSync(join(folder, "seen.json"), JSON.stringify(seen));
  // From far away rays are parallel, as in the page.
  const out = execFileSync(
    python,
    [
      "-c",
      `
import json, numpy as np, amontons as am
s = json.load(open("seen.json"))
target, way = np.array(s["target"]), np.array(s["way"])
camera = am.Camera(tuple(target + 1000 * way), tuple(target), s["width"], tuple(s["up"]))
line = np.array(s["line"]).reshape(-1, 3)
there = am.xray(line, camera, tuple(s["size"]), radius=float(np.median(s["radius"])), noise=0).astype(float)
here = np.array(s["grey"], float).reshape(s["size"])
way_through = lambda grey: np.log(200 / np.maximum(grey, 1)).sum()
print(json.dumps([np.abs(here - there).mean(), int((there < 195).sum()), way_through(here) / way_through(there)]))
`,
    ],
    { cwd: folder, encoding: "utf8", env: { ...process.env, PYTHONPATH: packages } },
  );
  const [mean, count, ratio] = JSON.parse(out);
  assert.ok(count > 500, out); // there is a shadow
  assert.ok(mean < 3, out);
  // The whole way through the wire, from all pixels: as long in both.
  assert.ok(Math.abs(ratio - 1) < 0.05, out);
  console.log(`      mean difference ${mean.toFixed(3)} grey levels; way through the wire ${ratio.toFixed(3)} of the package's`);
  await wire.getByRole("checkbox", { name: "Vessels and solids, too" }).check();
  await wire.waitForTimeout(500);
  await picture(wire, "studio_xray_wire", wire.getByRole("main"));
  assert.deepEqual(wire.problems, []);
  await wire.close();
}, here);

await test("no problem was logged", async () => assert.deepEqual(page.problems, []));
await browser.close();
