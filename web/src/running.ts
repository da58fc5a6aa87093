// Run, pause, step, stop, resume; the events of the engine.

import * as api from "./api";
import { el, select } from "./dom";
import { app, belowRoot, offline, type Health } from "./state";
import { request, showMessage } from "./messages";
import { Run } from "./runs";
import { listTimeline, setShown, showMoment, views } from "./timeline";
import { showChange, listDrives, refreshScene } from "./scene_panel";
import { addHealth, showHealth } from "./haptic_panel";
import { listFiles, listRuns } from "./runs_panel";
import { shortNumber } from "./colours";

export const status = el("span", { class: "status", role: "status", "aria-live": "off" });
export const run = el("button", { onclick: () => void runOn() }, "Run");
export const pause = el("button", { onclick: () => void request("pause") }, "Pause");
export const step = el("button", { onclick: () => void request("step", { count: 1 }) }, "Step");
export const stop = el("button", { onclick: () => void request("stop") }, "Stop");
export const restart = el("button", { onclick: () => void toBeginning() }, "To the beginning");
export const resume = el("button", { onclick: () => void resumeRun() }, "Resume");
let speed = "";
export const speedChooser = select(
  "Speed",
  [
    ["", "as fast as it can"],
    ["0.1", "0.1 of real time"],
    ["1", "real time"],
    ["10", "10 times"],
  ],
  "",
  (v) => {
    speed = v;
    if (app.engine === "running") void request("run", speedField());
  },
);
const speedField = () => (speed ? { speed: Number(speed) } : {});

async function runOn() {
  app.following = true;
  setShown(app.live);
  await request("run", speedField());
}

export async function toggleRun() {
  if (app.device) return;
  if (app.engine === "running") await request("pause");
  else await runOn();
}

/** After a pause it runs on; after its end it is started again from what was kept. */
async function resumeRun() {
  if (app.engine === "paused") return runOn();
  app.following = true;
  setShown(app.live);
  await request("resume");
}

async function toBeginning() {
  app.following = true;
  setShown(app.live);
  await request("reset");
}

export function showEngine(state: typeof app.engine, reason = "", canResume = false, savedTime: number | null = null) {
  app.engine = state;
  const alive = (state === "paused" || state === "running") && !app.device;
  run.disabled = state !== "paused" || !alive;
  pause.disabled = state !== "running" || !alive;
  step.disabled = state !== "paused" || !alive;
  restart.disabled = !alive;
  stop.disabled = state !== "paused" && state !== "running" && state !== "starting";
  resume.disabled = !canResume && !(state === "paused" && alive);
  if (state === "failed") {
    const where = app.folder ? ` What was written is in ${app.folder}.` : "";
    const again = app.device
      ? " Resume starts it again."
      : savedTime !== null
        ? ` Resume continues from t = ${shortNumber(savedTime)} s.`
        : "";
    showMessage(reason + "." + again + where, true);
  } else if (state === "stopped" && reason) showMessage(reason);
  for (const v of views) v.hurried = state === "running";
  showStatus();
}

export function showStatus() {
  const t = app.live.times.at(-1);
  const error = app.live.columns.get("certificate_error")?.at(-1);
  const parts: string[] = [app.engine === "none" ? "no simulation" : app.engine];
  if (app.device && app.engine === "running") parts.push("in the hand");
  if (t !== undefined) parts.push(`t ${shortNumber(t)} s`);
  if (app.instant && app.shown === app.live) parts.push(`${app.instant.contacts.length / 6} contacts`);
  if (error !== undefined && Number.isFinite(error)) parts.push(`error ${shortNumber(error)}`);
  status.textContent = offline ? "a run, as it was exported" : parts.join(" · ");
  status.dataset.engine = app.engine;
}

// ---- events

/** A step's event as a row of columns. */
function flatten(event: any): Record<string, number> {
  const row: Record<string, number> = { time: event.time };
  for (const [name, v] of Object.entries(event.quantities ?? {})) if (typeof v === "number") row[name] = v;
  row.contacts = event.contacts?.now ?? 0;
  if (typeof event.certificate?.error === "number") row.certificate_error = event.certificate.error;
  for (const name of ["work", "elastic", "kinetic", "friction"])
    if (typeof event.energy?.[name] === "number") row[name] = event.energy[name];
  if (event.step) {
    row.iterations = event.step.iterations;
    row.seconds = event.step.seconds;
  }
  return row;
}

const kUnits = { time: "s", seconds: "s", work: "J", elastic: "J", kinetic: "J", friction: "J" };
const kMostKept = 8;
let count = 0;
let lastState = "";

/** The live run becomes one of those before it. */
export function newLive() {
  if (app.live.times.length > 1) {
    app.live.name = "run " + ++count;
    app.kept.push(app.live);
    if (app.kept.length > kMostKept) app.kept.shift();
  }
  const was = app.shown === app.live;
  app.live = new Run("live");
  app.live.scene = app.scene;
  if (was) {
    app.shown = app.live;
    app.cursor = -1;
    app.following = true;
  }
  listRuns();
}

function takeStep(event: any) {
  const moved = event.after === undefined || event.after === "step" || event.after === "advance";
  const last = app.live.times.at(-1) ?? -Infinity;
  if (event.after === "reset" || event.time < last) newLive();
  if (moved) ++counts.steps;
  if (moved && event.step && event.time > (app.live.times.at(-1) ?? -Infinity))
    app.live.addRow(flatten(event), { ...kUnits, ...(event.units ?? {}) });
  for (const w of event.warnings ?? []) showMessage("warning: " + w);
  if (!moved) void refreshScene();
  app.changedRows = true;
}

export function takeEvent(event: any) {
  switch (event.event) {
    case "step":
      takeStep(event);
      break;
    case "paused":
      if (event.status === "failed") showMessage("the step failed: " + api.issueText(event.issues), true);
      else if (event.status === "done") showMessage(`the end of the scene is reached: t = ${shortNumber(event.time)} s`);
      break;
    case "engine":
      app.device = event.device ?? "";
      if (event.folder !== undefined) app.folder = belowRoot(event.folder);
      showEngine(event.state, event.reason, event.can_resume, event.saved_time);
      if (lastState === "starting" && (event.state === "paused" || event.state === "running")) void refreshScene();
      if (event.state === "starting") {
        app.frames.seq = 0;
        app.health = null;
        newLive();
        listDrives([]);
      }
      showHealth();
      lastState = event.state;
      break;
    case "results":
      app.folder = belowRoot(event.folder);
      if (app.folder) showMessage(`results are written to ${app.folder}`);
      void listFiles();
      break;
    case "haptic":
      addHealth(event as Health);
      break;
    case "set":
      showChange(event);
      break;
    case "report":
      showMessage(event.text);
      break;
    case "refused":
      showMessage(api.issueText(event.issues), true);
      break;
    case "log":
      showMessage(event.text);
      break;
    case "lost":
      showMessage(`the page was too slow for ${event.lines} events`, true);
      break;
  }
}

export function setLastState(state: string) {
  lastState = state;
}

// ---- frames

export const pace = { least: 30 }; // between two frames [ms]: at most 25 a second, more is not visible
let drawnAt = 0;
export const counts = { steps: 0, instants: 0, unpacking: 0 }; // [ms]

let waits = false;
/** Draws the newest instant. Where drawing is slow (no GPU), instants are kept more often than they are drawn. */
function drawSoon(newest: () => number) {
  if (waits) return;
  const left = app.engine === "running" ? 0.5 * views[0].cost - (performance.now() - drawnAt) : 0;
  const draw = () => {
    waits = false;
    drawnAt = performance.now();
    if (app.shown === app.live && app.following) void showMoment(newest());
  };
  waits = left > 0;
  if (waits) setTimeout(draw, left);
  else draw();
}

export async function pullFrames() {
  for (;;) {
    try {
      if (app.engine === "none" || app.engine === "failed" || app.engine === "stopped" || app.engine === "starting") {
        await new Promise((r) => setTimeout(r, 100));
        continue;
      }
      const requested = performance.now();
      const bytes = await api.frame(app.frames.seq);
      const newest = () => app.live.moments.length - 1;
      if (!bytes) {
        if (app.shown === app.live && app.following && app.cursor < newest()) void showMoment(newest());
        continue;
      }
      const begun = performance.now();
      const instant = app.frames.take(bytes);
      if (!instant) continue;
      counts.unpacking += performance.now() - begun;
      ++counts.instants;
      app.live.addInstant(instant);
      if (app.shown === app.live && app.following) drawSoon(newest);
      else if (app.shown === app.live) listTimeline();
      await new Promise((r) => setTimeout(r, Math.max(1, pace.least - (performance.now() - requested))));
    } catch {
      if (app.ended) return;
      await new Promise((r) => setTimeout(r, 500));
    }
  }
}
