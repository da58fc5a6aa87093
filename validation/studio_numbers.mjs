// What amontons studio costs and how quick it is, in a real browser with software rendering at 1280 x 800.
//
// usage: node validation/studio_numbers.mjs PROGRAM [FILE.json [SECTION]]
//
// Prints each number with its aim and the machine's load meanwhile: only on a machine that does nothing else are they
// those of docs/studio.md. SECTION: a pattern of the sections to be run.
// Aims: 12 pictures a second beside a running simulation, whose steps a drawing page takes 10 % of at most; 25 of a
// finished run; frames of 202 500 vertices at 20 a second, unpacked in 4 ms; 150 ms from a step that is requested to
// its frame (p95); a haptic loop misses no tick by its own work, its p99 grows by 10 % at most; the server takes
// less than 60 MB and three frames; amontons run maps no library of studio.

import { spawn } from "node:child_process";
import { existsSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { loadavg, cpus } from "node:os";
import { join } from "node:path";

const [, , , into = "", section = ""] = process.argv;
process.argv.splice(3); // the harness reads arguments of its own
const { button, example, folder, launch, newContext, open, program, runUntil, serve, status } = await import(
  "../web/tests/harness.mjs"
);

const kSeconds = 4; // of each measurement: a run that ends within it would count as slow
const rows = [];
function addRow(name, value, unit, aim, reached) {
  const row = { name, value: Number(value.toPrecision(4)), unit, aim, reached, load: Number(loadavg()[0].toFixed(1)) };
  rows.push(row);
  console.log(
    `${name.padEnd(66)} ${String(row.value).padStart(9)} ${unit.padEnd(14)} ${aim.padEnd(22)} ${reached === null ? "" : reached ? "reached" : "MISSED"}  (load ${row.load})`,
  );
}
const selected = (name) => !section || new RegExp(section).test(name);
const quantile = (numbers, q) => [...numbers].sort((a, b) => a - b)[Math.min(numbers.length - 1, Math.floor(q * numbers.length))];
const sleep = (s) => new Promise((r) => setTimeout(r, 1000 * s));

example("hapco/hexa.json", "hexa.json");
example("coaxial", "coaxial");
example("haptic_bed", "haptic_bed");
const scenes = [
  ["HapCo", "hexa.json", 1.2],
  ["coaxial", "coaxial/scene.json", 3],
];
console.log(`${cpus().length} x ${cpus()[0].model.trim()}, load ${loadavg().map((x) => x.toFixed(1)).join(" ")}`);

const rss = (pid) => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${pid}/status`, "utf8"))[1]) / 1024;

/** Steps and drawings in some seconds of a run. */
async function measureRun(page, seconds) {
  const read = () => page.evaluate(() => [studio.steps, studio.frames, studio.instants, performance.now()]);
  const [s0, f0, i0, t0] = await read();
  await sleep(seconds);
  const [s1, f1, i1, t1] = await read();
  const t = (t1 - t0) / 1000;
  return { steps: (s1 - s0) / t, frames: (f1 - f0) / t, instants: (i1 - i0) / t };
}

async function startAgain(page, from) {
  if (await button(page, "Pause").isEnabled()) await button(page, "Pause").click();
  await status(page, "paused");
  await button(page, "To the beginning").click();
  await page.waitForFunction(() => studio.live.times.length === 0);
  await runUntil(page, from);
  await button(page, "Run").click();
  await status(page, "running");
}

const browser = await launch();
const context = await newContext(browser);

if (selected("live"))
  for (const [name, scene, from] of scenes) {
    const server = await serve(scene, "--no-results");
    const page = await open(context, server.address);
    await status(page, "paused");
    // The same stretch of the run, in turn with a page that draws and one that does not.
    const drawing = [];
    const still = [];
    for (let round = 0; round < 3; ++round)
      for (const list of round % 2 ? [still, drawing] : [drawing, still]) {
        await page.evaluate((on) => studio.views.forEach((v) => (v.still = on)), list === still);
        await startAgain(page, from);
        list.push(await measureRun(page, kSeconds));
      }
    const mean = (list, what) => list.reduce((a, x) => a + x[what], 0) / list.length;
    const steps = mean(drawing, "steps");
    const frames = mean(drawing, "frames");
    addRow(`${name}: steps of a run whose page draws`, steps, "1/s", "", null);
    addRow(`${name}: pictures beside the running simulation`, frames, "1/s", steps < 12 ? "12, or each step" : "12", frames >= Math.min(12, 0.9 * steps));
    // The camera turns meanwhile: a picture needs no step.
    await page.evaluate(() => studio.views.forEach((v) => (v.still = false)));
    await startAgain(page, from);
    const box = await page.getByRole("img", { name: "View of the scene" }).boundingBox();
    await page.mouse.move(box.x + 300, box.y + 250);
    await page.mouse.down();
    let turning = true;
    const turn = (async () => {
      for (let i = 0; turning; ++i) {
        await page.mouse.move(box.x + 300 + 150 * Math.sin(i / 10), box.y + 250);
        await sleep(0.015);
      }
    })();
    const turned = await measureRun(page, kSeconds);
    turning = false;
    await turn;
    await page.mouse.up();
    addRow(`${name}: pictures while the camera turns beside the run`, turned.frames, "1/s", "12", turned.frames >= 12);
    const loss = 1 - steps / mean(still, "steps");
    addRow(`${name}: steps that a drawing page costs the run`, 100 * loss, "%", "<= 10", loss <= 0.1);
    const frame = await page.evaluate(async () => {
      const a = await fetch("/api/frame?after=0", { headers: { Authorization: "Bearer " + location.hash.slice(1) } });
      return (await a.arrayBuffer()).byteLength / 1048576;
    });
    const memory = rss(server.child.pid);
    addRow(`${name}: memory of the server`, memory, "MB", `< ${(60 + 3 * frame).toFixed(0)}`, memory < 60 + 3 * frame);
    await page.close();
    server.child.kill();
  }

if (selected("finished"))
  for (const [name, scene, until] of scenes) {
    const server = await serve(scene);
    const page = await open(context, server.address);
    await status(page, "paused");
    await runUntil(page, until);
    await button(page, "Stop").click();
    await status(page, "stopped");
    const results = await page.evaluate(() => studio.folder);
    await page.getByRole("combobox", { name: "Shown" }).selectOption("folder:" + results);
    await page.waitForFunction(() => studio.shown.folder !== "" && studio.shown.moments.length > 1);
    const [count, rate] = await page.evaluate(async () => {
      // Once for the files; then as often as it takes.
      const play = [...document.querySelectorAll("button")].find((b) => b.textContent === "Play");
      const done = () => new Promise((r) => { const i = setInterval(() => play.textContent === "Play" && (clearInterval(i), r()), 5); });
      play.click();
      await done();
      let frames = 0;
      let seconds = 0;
      while (seconds < 5) {
        const [f, t] = [studio.frames, performance.now()];
        play.click();
        await done();
        frames += studio.frames - f;
        seconds += (performance.now() - t) / 1000;
      }
      return [studio.shown.moments.length, frames / seconds];
    });
    addRow(`${name}: pictures of a finished run that is played (${count} instants)`, rate, "1/s", ">= 25 (30 are played)", rate >= 25);
    await page.close();
    server.child.kill();
  }

/** A closed surface of so many points, as an STL would have it but with shared corners: OBJ. */
function sphere(points) {
  const rings = Math.round(Math.sqrt((points - 2) / 2));
  const around = Math.round((points - 2) / rings);
  const out = ["v 0 0 0.05"];
  for (let i = 1; i <= rings; ++i)
    for (let k = 0; k < around; ++k) {
      const [a, b] = [(Math.PI * i) / (rings + 1), (2 * Math.PI * k) / around];
      out.push(`v ${0.05 * Math.sin(a) * Math.cos(b)} ${0.05 * Math.sin(a) * Math.sin(b)} ${0.05 * Math.cos(a)}`);
    }
  out.push("v 0 0 -0.05");
  const at = (i, k) => 2 + (i - 1) * around + (k % around);
  const last = 2 + rings * around;
  for (let k = 0; k < around; ++k) {
    out.push(`f 1 ${at(1, k)} ${at(1, k + 1)}`, `f ${last} ${at(rings, k + 1)} ${at(rings, k)}`);
    for (let i = 1; i < rings; ++i)
      out.push(`f ${at(i, k)} ${at(i + 1, k)} ${at(i + 1, k + 1)}`, `f ${at(i, k)} ${at(i + 1, k + 1)} ${at(i, k + 1)}`);
  }
  return out.join("\n") + "\n";
}

if (selected("transport")) {
  const drive = { z: [[0, 0], [1000, 1]] };
  for (const [count, least] of [[20000, 20], [202500, 20]]) {
    writeFileSync(join(folder, `ball_${count}.obj`), sphere(count));
    writeFileSync(
      join(folder, `ball_${count}.json`),
      JSON.stringify({
        schema: 1,
        bodies: { ball: { kind: "rigid", density: 1000, shape: { file: `ball_${count}.obj` }, drive } },
        contact: [],
        time: { kind: "dynamic", step: 0.01, end: 1000 },
        output: { every: 1000000 },
      }),
    );
    const server = await serve(`ball_${count}.json`, "--no-results");
    // A page of the server that draws nothing of its own.
    const page = await context.newPage();
    await page.goto(server.address.replace("/#", "/licences.txt#"));
    const token = server.address.split("#")[1];
    const measured = await page.evaluate(
      async ([token, seconds, scene]) => {
        const headers = { Authorization: "Bearer " + token };
        let id = 0;
        const send = async (what, more = {}) =>
          (await fetch("/api/command", { method: "POST", headers, body: JSON.stringify({ id: ++id, do: what, ...more }) })).json();
        const state = async () => (await (await fetch("/api/state", { headers })).json()).engine.state;
        await send("start", { scene });
        for (let i = 0; i < 600 && (await state()) !== "paused"; ++i) await new Promise((r) => setTimeout(r, 100));
        let seq = 0;
        const frame = async () => {
          const a = await fetch("/api/frame?after=" + seq, { headers });
          if (a.status !== 200) return null;
          const bytes = await a.arrayBuffer();
          const length = new DataView(bytes).getUint32(4, true);
          const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length)));
          seq = head.seq;
          return { head, size: bytes.byteLength };
        };
        await send("step");
        await frame();
        const late = [];
        for (let i = 0; i < 60; ++i) {
          const begun = performance.now();
          const sent = send("step");
          for (let f = await frame(); !f; ) f = await frame();
          late.push(performance.now() - begun);
          await sent;
        }
        await send("run");
        const begun = performance.now();
        let frames = 0;
        let bytes = 0;
        while (performance.now() - begun < 1000 * seconds) {
          const f = await frame();
          if (f) {
            ++frames;
            bytes += f.size;
          }
        }
        const time = (performance.now() - begun) / 1000;
        await send("pause");
        return { rate: frames / time, megabytes: bytes / time / 1048576, late };
      },
      [token, kSeconds, `ball_${count}.json`],
    );
    addRow(`${count} vertices: frames that reach the page`, measured.rate, "1/s", String(least), measured.rate >= least);
    addRow(`${count} vertices: bytes`, measured.megabytes, "MB/s", "", null);
    addRow(`${count} vertices: from a step that is requested to its frame, p95`, quantile(measured.late, 0.95), "ms", "< 150", quantile(measured.late, 0.95) < 150);
    addRow(`${count} vertices: memory of the server`, rss(server.child.pid), "MB", "", null);
    await page.close();
    server.child.kill();
  }
  const server = await serve("ball_202500.json", "--no-results");
  const page = await open(context, server.address);
  await status(page, "paused", 60);
  await page.evaluate(() => studio.views.forEach((v) => (v.still = true)));
  await button(page, "Run").click();
  await sleep(kSeconds);
  const unpacked = await page.evaluate(() => studio.unpacking);
  addRow("202500 vertices: a frame is unpacked in", unpacked, "ms", "<= 4", unpacked <= 4);
  await page.close();
  server.child.kill();
}

if (selected("haptic")) {
  const traces = {};
  const rendered = {};
  for (const with_page of [true, false]) {
    const server = await serve("haptic_bed/scene.json", "--results", with_page ? "seen" : "unseen");
    const page = await open(context, server.address);
    await status(page, "paused");
    await page.getByText("In the hand", { exact: true }).click();
    await button(page, "Start in the hand").click();
    await status(page, "running", 60);
    await sleep(1);
    // The same page, in another tab than the one that is seen: nothing is drawn.
    if (!with_page) await page.goto("about:blank");
    await sleep(4.5);
    if (with_page) rendered.frames = await page.evaluate(() => studio.frames);
    if (with_page) rendered.missed = await page.evaluate(() => studio.health.missed_by_work);
    await page.close();
    for (let i = 0; i < 60; ++i) {
      const of = existsSync(join(folder, with_page ? "seen" : "unseen")) ? readdirSync(join(folder, with_page ? "seen" : "unseen")).find((f) => f.includes("-hand-")) : null;
      const file = of && join(folder, with_page ? "seen" : "unseen", of, "haptics.csv");
      if (file && existsSync(file)) {
        traces[with_page] = readFileSync(file, "utf8").trim().split("\n").map((l) => l.split(","));
        break;
      }
      await sleep(0.5);
    }
    server.child.kill();
  }
  const p99 = (trace) => {
    const at = trace[0].indexOf("compute [s]");
    return 1e6 * quantile(trace.slice(1).map((r) => Number(r[at])), 0.99);
  };
  const over = (trace) => {
    const at = trace[0].indexOf("cpu [s]");
    return trace.slice(1).filter((r) => Number(r[at]) > 1e-3).length;
  };
  const [seen, unseen] = [p99(traces.true), p99(traces.false)];
  addRow("haptic: pictures of the run in the hand", rendered.frames / 5.5, "1/s", "", null);
  addRow("haptic: ticks missed by their own work, with a page that draws", over(traces.true), "", "0", over(traces.true) === 0);
  addRow("haptic: ticks missed by their own work, without", over(traces.false), "", "0", over(traces.false) === 0);
  addRow("haptic: p99 of a tick with a page that draws", seen, "µs", "", null);
  addRow("haptic: p99 of a tick without", unseen, "µs", "", null);
  addRow("haptic: growth of the p99", 100 * (seen / unseen - 1), "%", "<= 10", seen <= 1.1 * unseen);
}

if (selected("libraries")) {
  const run = spawn(program, ["run", "hexa.json", "-o", join(folder, "mapped"), "--quiet"], { cwd: folder });
  let maps = "";
  for (let i = 0; i < 50 && !maps.includes("libc.so"); ++i) {
    await sleep(0.05);
    maps = readFileSync(`/proc/${run.pid}/maps`, "utf8");
  }
  await sleep(1);
  if (existsSync(`/proc/${run.pid}/maps`)) maps += readFileSync(`/proc/${run.pid}/maps`, "utf8");
  const found = new Set([...maps.matchAll(/\/\S*(?:httplib|libssl|libcrypto|brotli|amontons-studio)\S*/g)].map((m) => m[0]));
  addRow("libraries of studio that amontons run maps" + [...found].join(), found.size, "", "0", found.size === 0);
  run.kill();
}

await browser.close();
if (into) writeFileSync(into, JSON.stringify({ machine: cpus()[0].model.trim(), cores: cpus().length, rows }, null, 1) + "\n");
const missed = rows.filter((r) => r.reached === false).length;
console.log(missed ? `${missed} aims are missed` : "all aims are reached");
process.exit(missed ? 1 : 0);
