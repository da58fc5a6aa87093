// The page of amontons studio: what it shows, and what its controls ask for.

import * as api from "./api";
import { LiveReader, type Body, type Instant } from "./frames";
import { kPresets, View, type Look, type Mode } from "./view";
import { Run, openResults } from "./runs";
import { Plot } from "./plots";
import { editor, valueAt } from "./editor";
import { boxOf, centreOf, grow, inBox, type Vec } from "./sets";
import { el, labelled, save, select } from "./dom";
import { dataOf, exported, exportPage } from "./export";
import { shortNumber } from "./colours";

const kModes: [Mode, string][] = [
  ["normal", "Normal"],
  ["wire", "Wire"],
  ["transparent", "Transparent"],
  ["xray", "X-ray"],
];
const kFirstColumns = ["push_force", "contacts", "certificate_error"];
const kSetNames: Record<string, string[]> = {
  box: ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"],
  ball: ["outer"],
  cylinder: ["start", "end", "outer"],
  tube: ["inner", "outer", "start", "end"],
};

interface Input {
  name: string;
  unit: string;
  least: number | null;
  largest: number | null;
  value: number;
}

// ---- what is known

const look: Look = { mode: "normal", bodies: new Map(), field: "", arrows: true, range: null };
let root = "";
let schema: any = {};
let scene: any = null; // with every default
let start: { scene: string; set: string[] } = { scene: "", set: [] };
let engine = "none";
let live = new Run("live");
let shown: Run = live; // what timeline and view show
let other: Run | null = null; // compared with it
const kept: Run[] = [];
let cursor = -1; // of shown.moments
let following = true;
let shownInstant: Instant | null = null;
let liveCount = 0;
let undoList: { path: string; old: any; set?: string[] }[] = []; // set: of the start before it
let picked: { body: Body; triangles: number[]; set: any } | null = null;
let pickMode: "" | "grow" | "box" = "";
const offline = exported();

// ---- what is on the page

const status = el("span", { class: "status", role: "status", "aria-live": "off" });
const messages = el("ul");
const log = el("div", { class: "messages", "aria-label": "Messages", role: "log", tabindex: 0 }, messages);
const views = [new View("View of the scene", look), new View("View of the run compared with", look)];
const viewNames = views.map((v) => {
  const name = el("div", { class: "name" });
  v.element.append(name);
  return name;
});
const main = el("main", {}, views[0].element);
const bodyList = el("div");
const fieldChooser = el("div");
const fieldTree = el("div");
const drives = el("div");
const holds = el("div");
const timeline = el("input", { type: "range", min: 0, max: 0, value: 0, "aria-label": "Timeline" });
const timeText = el("output", { "aria-label": "Time shown" });
const plots = [
  new Plot("First plot", (t) => seekTime(t)),
  new Plot("Second plot", (t) => seekTime(t)),
];
let difference = false;

function say(text: string, bad = false) {
  if (!text) return;
  const first = messages.firstElementChild;
  if (first?.textContent === text) return;
  messages.prepend(el("li", { class: bad ? "bad" : "" }, text));
  while (messages.children.length > 100) messages.lastElementChild!.remove();
}

async function ask(what: string, fields: object = {}): Promise<api.Answer> {
  const answer = await api.command(what, fields);
  if (!answer.ok) say(`${what}: ${api.issueText(answer.issues)}`, true);
  return answer;
}

// ---- running

const run = el("button", { onclick: () => void toggleRun() }, "Run");
const step = el("button", { onclick: () => void ask("step", { count: 1 }) }, "Step");
const stop = el("button", { onclick: () => void ask("stop") }, "Stop");
const restart = el("button", { onclick: () => void ask("reset") }, "To the beginning");
const resume = el("button", { onclick: () => void ask("resume") }, "Resume");
let speed = "";
const speedChooser = select(
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
    if (engine === "running") void ask("run", speed ? { speed: Number(speed) } : {});
  },
);

async function toggleRun() {
  if (engine === "running") return void (await ask("pause"));
  following = true;
  setShown(live);
  await ask("run", speed ? { speed: Number(speed) } : {});
}

function showEngine(state: string, reason = "", canResume = false, savedTime: number | null = null) {
  engine = state;
  const alive = state === "paused" || state === "running";
  run.textContent = state === "running" ? "Pause" : "Run";
  run.disabled = !alive;
  step.disabled = state !== "paused";
  restart.disabled = !alive;
  stop.disabled = !alive && state !== "starting";
  resume.hidden = !canResume;
  if (state === "failed")
    say(reason + (savedTime !== null ? `. Resume goes on from t = ${shortNumber(savedTime)} s.` : ""), true);
  tellStatus();
}

function tellStatus() {
  const now = shownInstant;
  const t = live.times[live.times.length - 1];
  const error = live.columns.get("certificate_error")?.at(-1);
  const parts = [engine === "none" ? "no simulation" : engine];
  if (t !== undefined) parts.push(`t ${shortNumber(t)} s`);
  if (now && shown === live) parts.push(`${now.contacts.length / 6} contacts`);
  if (error !== undefined && Number.isFinite(error)) parts.push(`error ${shortNumber(error)}`);
  status.textContent = offline ? "a run, as it was exported" : parts.join(" · ");
  status.dataset.engine = engine;
}

// ---- events

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

function newLive() {
  if (live.times.length > 1) {
    live.name = "run " + ++liveCount;
    kept.push(live);
    if (kept.length > 8) kept.shift();
  }
  const was = shown === live;
  live = new Run("live");
  live.scene = scene;
  if (was) {
    shown = live;
    cursor = -1;
    following = true;
  }
  listRuns();
}

function takeEvent(event: any) {
  switch (event.event) {
    case "step": {
      const moved = event.after === undefined || event.after === "step" || event.after === "advance";
      const last = live.times[live.times.length - 1] ?? -Infinity;
      if (event.after === "reset" || event.time < last) newLive();
      if (moved && event.step && event.time > (live.times[live.times.length - 1] ?? -Infinity))
        live.addRow(flatten(event), { ...kUnits, ...(event.units ?? {}) });
      for (const w of event.warnings ?? []) say("warning: " + w);
      if (!moved) void refreshScene();
      changedRows = true;
      break;
    }
    case "paused":
      if (event.status === "failed") say("the step failed: " + api.issueText(event.issues), true);
      else if (event.status === "done") say(`the end of the scene is reached: t = ${shortNumber(event.time)} s`);
      break;
    case "engine":
      showEngine(event.state, event.reason, event.can_resume, event.saved_time);
      if (event.state === "paused" && lastState === "starting") void refreshScene();
      if (event.state === "starting") {
        frames.seq = 0;
        newLive();
      }
      lastState = event.state;
      break;
    case "refused":
      say(api.issueText(event.issues), true);
      break;
    case "log":
      say(event.text);
      break;
    case "lost":
      say(`the page was too slow for ${event.lines} events`, true);
      break;
  }
}

let lastState = "";
let changedRows = true;
const frames = new LiveReader();
let drawnAt = 0;

async function pullFrames() {
  for (;;) {
    try {
      if (engine === "none" || engine === "failed" || engine === "stopped") {
        await new Promise((r) => setTimeout(r, 200));
        continue;
      }
      const bytes = await api.frame(frames.seq);
      if (!bytes) {
        if (shown === live && following && cursor < live.moments.length - 1) showMoment(live.moments.length - 1);
        continue;
      }
      const instant = frames.take(bytes);
      if (!instant) continue;
      live.addInstant(instant);
      // Where drawing is slow (no GPU), instants are kept more often than they are drawn.
      const now = performance.now();
      if (shown === live && following && (now - drawnAt > 2 * views[0].cost || engine !== "running")) {
        drawnAt = now;
        showMoment(live.moments.length - 1);
      } else listTimeline();
      // At most 25 a second, which is what eyes ask for.
      await new Promise((r) => setTimeout(r, 30));
    } catch {
      if (ended) return;
      await new Promise((r) => setTimeout(r, 500));
    }
  }
}

// ---- timeline and views

function setShown(r: Run) {
  if (shown === r) return;
  shown = r;
  cursor = -1;
  runChooser.value = runKey(r);
  changedRows = true;
  if (r.moments.length > 0) showMoment(r === live ? r.moments.length - 1 : 0);
}

function listTimeline() {
  timeline.max = String(Math.max(0, shown.moments.length - 1));
  timeline.value = String(Math.max(0, cursor));
}

let loading = 0;
async function showMoment(index: number) {
  if (index < 0 || index >= shown.moments.length) return;
  const mine = ++loading;
  const from = shown;
  const instant = shown.moments[index].instant ?? (await shown.load(index).catch((e) => (say(String(e.message), true), null)));
  if (mine !== loading || from !== shown || !instant) return;
  cursor = index;
  shownInstant = instant;
  look.bodies.size || instant.bodies.forEach((b) => look.bodies.set(b.name, { shown: true, mode: "" }));
  listBodies(instant);
  views[0].show(instant);
  timeText.textContent = `t = ${shortNumber(instant.time)} s`;
  timeline.setAttribute("aria-valuetext", timeText.textContent);
  listTimeline();
  for (const p of plots) p.setTime(instant.time);
  tellStatus();
  if (other) {
    viewNames[0].textContent = `${shown.name}, t = ${shortNumber(instant.time)} s`;
    const there = other.nearest(instant.time);
    const second = there < 0 ? null : await other.load(there).catch(() => null);
    if (mine === loading) {
      views[1].show(second);
      views[0].restyle(); // one range of colours for both
      viewNames[1].textContent = second ? `${other.name}, t = ${shortNumber(second.time)} s` : other.name + ": no pictures";
    }
  }
}

function seekTime(time: number) {
  const at = shown.nearest(time);
  following = shown === live && at === shown.moments.length - 1;
  void showMoment(at);
}

timeline.addEventListener("input", () => {
  const at = Number(timeline.value);
  following = shown === live && at === shown.moments.length - 1;
  void showMoment(at);
});

let playing = false;
const play = el("button", { onclick: () => void playOn(), "aria-pressed": "false" }, "Play");
async function playOn() {
  playing = !playing;
  play.textContent = playing ? "Hold" : "Play";
  play.setAttribute("aria-pressed", String(playing));
  if (playing && cursor >= shown.moments.length - 1) await showMoment(0);
  while (playing && cursor < shown.moments.length - 1) {
    const begun = performance.now();
    following = false;
    await showMoment(cursor + 1);
    await new Promise((r) => setTimeout(r, Math.max(0, 40 - (performance.now() - begun))));
  }
  playing = false;
  play.textContent = "Play";
  play.setAttribute("aria-pressed", "false");
}

for (const [a, b] of [
  [0, 1],
  [1, 0],
])
  views[a].onCamera = () => {
    if (!other || tying) return;
    tying = true;
    views[b].setCamera(views[a].getCamera(), views[a]);
    tying = false;
  };
let tying = false;

// ---- bodies and how they look

let bodyNames = "";
function listBodies(instant: Instant) {
  const names = instant.bodies.map((b) => b.name).join();
  const fields = [...new Set(instant.bodies.flatMap((b) => b.fields.map((f) => f.name)))];
  const key = names + "|" + fields.join();
  if (key === bodyNames) return;
  bodyNames = key;
  bodyList.replaceChildren(
    ...instant.bodies.map((b) => {
      const mine = look.bodies.get(b.name) ?? { shown: true, mode: "" as const };
      look.bodies.set(b.name, mine);
      const box = el("input", {
        type: "checkbox",
        checked: mine.shown,
        id: "show-" + b.name,
        onchange: () => {
          mine.shown = box.checked;
          restyle();
        },
      });
      return el(
        "div",
        { class: "body" },
        box,
        el("label", { for: "show-" + b.name }, b.name),
        select(
          "Mode of " + b.name,
          [["", "as all"], ...kModes.filter(([m]) => m !== "xray")] as [string, string][],
          mine.mode,
          (v) => {
            mine.mode = v as Mode | "";
            restyle();
          },
        ),
      );
    }),
  );
  if (!fields.includes(look.field)) look.field = fields.includes("von Mises stress") ? "von Mises stress" : "";
  fieldChooser.replaceChildren(
    select("Colour by", [["", "nothing"], ...fields.map((f) => [f, f] as [string, string])], look.field, (v) => {
      look.field = v;
      look.range = null;
      restyle();
    }),
  );
}

function restyle() {
  views[0].restyle();
  if (other) views[1].restyle();
}

function modeChoices(): HTMLElement {
  return el(
    "fieldset",
    {},
    el("legend", {}, "Mode"),
    el(
      "div",
      { class: "choices" },
      ...kModes.map(([mode, text]) => {
        const radio = el("input", {
          type: "radio",
          name: "mode",
          id: "mode-" + mode,
          checked: look.mode === mode,
          onchange: () => {
            look.mode = mode;
            restyle();
          },
        });
        return el("span", {}, radio, " ", el("label", { for: "mode-" + mode }, text));
      }),
    ),
  );
}

// ---- the scene: fields, holds, sets, drives

let filter = "";

async function refreshScene() {
  if (offline) return;
  const [answer, inputs, state] = await Promise.all([api.command("scene"), api.command("inputs"), api.get("/api/state")]);
  if (!answer.ok) return;
  scene = answer.scene;
  live.scene = scene;
  start.set = state.engine.set;
  listFields();
  listHolds();
  if (inputs.ok) listDrives(inputs.inputs);
}

function listFields() {
  const open = new Set([...fieldTree.querySelectorAll("details[open] > summary")].map((s) => s.textContent));
  const first = fieldTree.childElementCount === 0;
  const focus = (document.activeElement as HTMLElement | null)?.dataset?.path;
  const tree = editor(scene, schema, filter, (path, value, old) => void setField(path, value, old));
  if (!first && !filter)
    for (const d of tree.querySelectorAll("details")) d.open = open.has(d.firstElementChild!.textContent);
  fieldTree.replaceChildren(tree);
  if (focus) fieldTree.querySelector<HTMLElement>(`[data-path="${CSS.escape(focus)}"]`)?.focus();
}

/** A field of the scene, between two steps; what does not fit the state needs a new start, which is offered. */
async function setField(path: string, value: any, old: any, undoing = false): Promise<boolean> {
  const answer = await api.command("set", { path, value });
  if (answer.ok) {
    if (!undoing) undoList.push({ path, old });
    undo.disabled = undoList.length === 0;
    say(`${path} is ${JSON.stringify(value)} from t = ${shortNumber(answer.time)} s on`);
    return true;
  }
  // Bodies of another make do not continue from the state of these: that needs a new start.
  if ((answer.issues ?? []).some((i) => i.file === "checkpoint")) {
    const again = async () => {
      const undone = [...undoList, { path, old, set: start.set }];
      await begin(start.scene, [...start.set, `${path}=${JSON.stringify(value)}`]);
      undoList = undone;
      undo.disabled = false;
    };
    if ((live.times.at(-1) ?? 0) === 0) {
      say(`${path} is changed: started again with it`);
      await again();
      return true;
    }
    messages.prepend(
      el("li", {}, `${path} needs a new start. `, el("button", { onclick: () => void again() }, "Start again with it")),
    );
    listFields();
    return false;
  }
  say(`${path}: ${api.issueText(answer.issues)}`, true);
  listFields();
  return false;
}

const undo = el("button", {
  disabled: true,
  onclick: async () => {
    const last = undoList.pop();
    const rest = undoList;
    if (last?.set) {
      await begin(start.scene, last.set);
      undoList = rest;
    } else if (last) await setField(last.path, last.old, null, true);
    undo.disabled = undoList.length === 0;
  },
}, "Undo");

async function begin(path: string, set: string[] = []) {
  start = { scene: path, set };
  undoList = [];
  undo.disabled = true;
  look.bodies.clear();
  bodyNames = "";
  setShown(live);
  await ask("start", { scene: path, set });
}

function solids(): [string, any][] {
  return Object.entries(scene?.bodies ?? {}).filter(([, b]: [string, any]) => b.kind === "solid") as [string, any][];
}

function listHolds() {
  holds.replaceChildren(
    ...solids().map(([name, body]) => {
      const list: any[] = body.hold ?? [];
      const sets = [...(kSetNames[body.mesh?.generate] ?? []), ...Object.keys(body.sets ?? {}), "all"];
      const chooser = select("Set of " + name, sets.map((s) => [s, s]), sets[0], () => {});
      const change = (next: any[]) => void setField(`bodies.${name}.hold`, next, list);
      return el(
        "div",
        {},
        el("h2", {}, name),
        ...list.map((h, i) =>
          el(
            "div",
            { class: "hold" },
            el("span", {}, `${h.set}: ${["x", "y", "z"].filter((a) => a in h).join(", ") || "nothing"} held`),
            el("button", { "aria-label": `Free ${h.set} of ${name}`, onclick: () => change(list.filter((_, k) => k !== i)) }, "Free"),
          ),
        ),
        el(
          "div",
          { class: "hold" },
          chooser,
          el("button", { "aria-label": `Hold the set of ${name}`, onclick: () => change([...list, { set: chooser.value, x: 0, y: 0, z: 0 }]) }, "Hold"),
        ),
      );
    }),
  );
}

function listDrives(inputs: Input[]) {
  drives.replaceChildren(
    ...inputs.map((i) => {
      const span = i.unit === "rad" ? Math.PI : i.unit === "m" ? 0.02 : Math.max(1, Math.abs(i.value));
      const low = i.least ?? i.value - span;
      const high = i.largest ?? i.value + span;
      let waiting = false;
      let next: number | null = null;
      const send = async (v: number) => {
        next = v;
        if (waiting) return;
        waiting = true;
        while (next !== null) {
          const now: number = next;
          next = null;
          await ask("set", { path: i.name, value: now });
          await new Promise((r) => setTimeout(r, 40));
        }
        waiting = false;
      };
      const slider = el("input", {
        type: "range",
        min: low,
        max: high,
        step: (high - low) / 1000,
        value: i.value,
        "aria-label": i.name,
        oninput: () => {
          text.value = shortNumber(Number(slider.value));
          void send(Number(slider.value));
        },
      });
      const text = el("input", {
        type: "text",
        value: shortNumber(i.value),
        "aria-label": `Value of ${i.name}`,
        onchange: () => {
          if (!Number.isFinite(Number(text.value))) return void (text.value = slider.value);
          slider.value = text.value;
          void send(Number(text.value));
        },
      });
      return el("div", {}, el("h2", {}, `${i.name} [${i.unit}]`), el("div", { class: "row" }, slider, text));
    }),
    ...(inputs.length === 0 ? [el("p", { class: "hint" }, "This scene has nothing that can be led by hand.")] : []),
  );
}

// ---- sets by picking

let angle = 30;
const setName = el("input", { type: "text", value: "picked", "aria-label": "Name of the set" });
const setTold = el("output", { class: "hint", "aria-label": "Picked faces" });
const rubber = el("div", { class: "rubber", hidden: true });
views[0].element.append(rubber);

function setPickMode(mode: typeof pickMode) {
  pickMode = mode;
  views[0].interactive = mode !== "box";
}

/** From a place of the view to one of the mesh: scenes name places before `start` has moved the body. */
function meshPlace(name: string, p: Vec): Vec {
  const { place = [0, 0, 0], turn = [0, 0, 0] } = scene?.bodies?.[name]?.start ?? {};
  const x = p.map((v, k) => v - place[k]) as Vec;
  const a = Math.hypot(...(turn as Vec));
  if (a === 0) return x;
  const n = (turn as Vec).map((v) => v / a) as Vec; // Rodrigues, backwards
  const c = Math.cos(a);
  const s = -Math.sin(a);
  const d = n[0] * x[0] + n[1] * x[1] + n[2] * x[2];
  const w = [n[1] * x[2] - n[2] * x[1], n[2] * x[0] - n[0] * x[2], n[0] * x[1] - n[1] * x[0]];
  return x.map((v, k) => v * c + w[k] * s + n[k] * d * (1 - c)) as Vec;
}

function isTurned(name: string): boolean {
  return Math.hypot(...((scene?.bodies?.[name]?.start?.turn ?? [0, 0, 0]) as Vec)) > 0;
}

/** Places of the mesh are those of the beginning: picking is on the first instant. */
async function atBeginning(): Promise<boolean> {
  if (shown !== live || shown.moments.length === 0 || (shown.moments[0].instant?.step ?? 1) > 0) {
    say("sets are picked where the scene begins: press To the beginning first", true);
    return false;
  }
  following = false;
  if (cursor !== 0) await showMoment(0);
  return true;
}

function setPicked(body: Body, triangles: number[], set: any) {
  picked = { body, triangles, set };
  views[0].mark(body, triangles);
  setTold.textContent = `${triangles.length} triangles of ${body.name}`;
  makeSet.disabled = triangles.length === 0;
}

const round = (x: number) => Number(x.toPrecision(6));

async function pickAt(x: number, y: number) {
  if (!(await atBeginning())) return;
  const hit = views[0].pick(x, y);
  if (!hit) return;
  // The middle of the triangle, well inside of the face that is meant.
  const at = meshPlace(hit.body.name, centreOf(hit.body, hit.triangle)).map(round);
  setPicked(hit.body, grow(hit.body, hit.triangle, angle), { faces_like: { at, angle } });
}

async function pickBox(x0: number, y0: number, x1: number, y1: number) {
  if (!(await atBeginning())) return;
  const hit = views[0].pick((x0 + x1) / 2, (y0 + y1) / 2);
  if (!hit) return void say("the middle of the box is on no solid", true);
  if (isTurned(hit.body.name)) return void say("boxes lie along the axes of the mesh: this body starts turned", true);
  const box = boxOf(hit.body, views[0].project(hit.body.points), [x0, y0, x1, y1]);
  if (!box) return;
  const [from, to] = box;
  const name = hit.body.name;
  setPicked(hit.body, inBox(hit.body, from, to), { box: { from: meshPlace(name, from), to: meshPlace(name, to) } });
}

let down: [number, number] | null = null;
const place = (e: PointerEvent): [number, number] => {
  const r = views[0].element.getBoundingClientRect();
  return [e.clientX - r.left, e.clientY - r.top];
};
views[0].canvas.addEventListener("pointerdown", (e) => (down = place(e)));
views[0].canvas.addEventListener("pointermove", (e) => {
  if (pickMode !== "box" || !down) return;
  const [x, y] = place(e);
  rubber.hidden = false;
  rubber.style.left = Math.min(x, down[0]) + "px";
  rubber.style.top = Math.min(y, down[1]) + "px";
  rubber.style.width = Math.abs(x - down[0]) + "px";
  rubber.style.height = Math.abs(y - down[1]) + "px";
});
views[0].canvas.addEventListener("pointerup", (e) => {
  const from = down;
  down = null;
  rubber.hidden = true;
  if (!from || !pickMode) return;
  const [x, y] = place(e);
  if (pickMode === "grow" && Math.hypot(x - from[0], y - from[1]) < 4) void pickAt(x, y);
  if (pickMode === "box") void pickBox(Math.min(x, from[0]), Math.min(y, from[1]), Math.max(x, from[0]), Math.max(y, from[1]));
});

const makeSet = el("button", {
  disabled: true,
  onclick: async () => {
    if (!picked) return;
    const name = picked.body.name;
    const sets = scene.bodies[name].sets ?? {};
    if (await setField(`bodies.${name}.sets`, { ...sets, [setName.value]: picked.set }, sets)) {
      views[0].mark(null);
      picked = null;
      makeSet.disabled = true;
      setTold.textContent = "";
    }
  },
}, "Make the set");

function picking(): HTMLElement {
  return el(
    "div",
    {},
    labelled(
      "Pick by",
      select(
        "Pick by",
        [
          ["", "nothing"],
          ["grow", "a click, and faces like it"],
          ["box", "a box"],
        ],
        "",
        (v) => setPickMode(v as typeof pickMode),
      ),
    ),
    labelled(
      "Angle",
      el("input", { type: "text", value: angle, "aria-label": "Angle of growing", onchange: (e: Event) => (angle = Math.min(180, Math.max(5, Number((e.target as HTMLInputElement).value) || 30))) }),
      el("span", { class: "unit" }, "degree"),
    ),
    labelled("Name", setName),
    el("div", { class: "hold" }, makeSet, setTold),
  );
}

// ---- runs, compared and exported

const runKey = (r: Run) => (r === live ? "live" : kept.includes(r) ? "kept:" + r.name : "folder:" + r.folder);
const runChooser = el("select", { "aria-label": "Run shown", onchange: () => void chooseRun(runChooser.value, setShown) });
const compareChooser = el("select", { "aria-label": "Compare with", onchange: () => void chooseRun(compareChooser.value, compareWith) });
let folders: string[] = [];
const openFolders = new Map<string, Run>();

function listRuns() {
  const options: [string, string][] = offline
    ? kept.map((r) => ["kept:" + r.name, r.name])
    : [
        ["live", "live"],
        ...kept.map((r) => ["kept:" + r.name, r.name] as [string, string]),
        ...folders.map((f) => ["folder:" + f, f] as [string, string]),
      ];
  runChooser.replaceChildren(...options.map(([v, t]) => el("option", { value: v }, t)));
  runChooser.value = runKey(shown);
  const was = other ? runKey(other) : "";
  compareChooser.replaceChildren(
    el("option", { value: "" }, "nothing"),
    ...options.map(([v, t]) => el("option", { value: v }, t)),
  );
  compareChooser.value = was;
}

async function runOf(key: string): Promise<Run | null> {
  if (key === "live") return live;
  if (key.startsWith("kept:")) return kept.find((r) => "kept:" + r.name === key) ?? null;
  const folder = key.slice("folder:".length);
  let r = openFolders.get(folder);
  if (!r) {
    r = await openResults(folder);
    openFolders.set(folder, r);
  }
  return r;
}

async function chooseRun(key: string, take: (r: Run) => void) {
  try {
    const r = key ? await runOf(key) : null;
    if (r) take(r);
    else compareWith(null);
  } catch (error) {
    say(String((error as Error).message), true);
  }
}

function compareWith(r: Run | null) {
  other = r;
  views[0].partner = r ? views[1] : null;
  views[1].partner = r ? views[0] : null;
  if (!r) views[0].restyle();
  if (r) {
    main.append(views[1].element);
  } else {
    views[1].element.remove();
    viewNames[0].textContent = "";
  }
  changedRows = true;
  requestAnimationFrame(async () => {
    await showMoment(Math.max(0, cursor));
    if (other) views[1].setCamera(views[0].getCamera(), views[0]);
  });
}

function pictureOf(): HTMLCanvasElement {
  const parts = (other ? views : views.slice(0, 1)).map((v) => v.picture());
  if (parts.length === 1) return parts[0];
  const out = document.createElement("canvas");
  out.width = parts[0].width + parts[1].width;
  out.height = parts[0].height;
  const g = out.getContext("2d")!;
  g.drawImage(parts[0], 0, 0);
  g.drawImage(parts[1], parts[0].width, 0);
  return out;
}

async function exportAs(what: string) {
  const name = (shown.name || "run").replace(/[^A-Za-z0-9_-]+/g, "_");
  if (what === "png") pictureOf().toBlob((b) => b && save(name + ".png", b));
  if (what === "svg") save(`${name}_${plots[0].column}.svg`, new Blob([plots[0].svg()], { type: "image/svg+xml" }));
  if (what === "csv") save(name + ".csv", new Blob([shown.csv()], { type: "text/csv" }));
  if (what === "html") {
    say("the page is being written");
    save(name + ".html", await exportPage(await dataOf(shown)));
  }
}

// ---- the page

const sceneChooser = el("select", { "aria-label": "Scene" });
let ended = false;

const saveName = el("input", { type: "text", "aria-label": "File of the scene", value: "changed.json" });
async function saveScene() {
  const folder = start.scene.includes("/") ? start.scene.slice(0, start.scene.lastIndexOf("/") + 1) : "";
  const answer = await ask("save_scene", { path: folder + saveName.value, scene });
  if (answer.ok) say("written: " + answer.path);
}

function section(title: string, open: boolean, ...inside: Node[]): HTMLElement {
  return el("details", { open }, el("summary", {}, title), ...inside);
}

function layOut() {
  const button = (text: string, click: () => void, label = text) => el("button", { onclick: click, "aria-label": label }, text);
  document.body.replaceChildren(
    el(
      "header",
      {},
      el("h1", {}, "amontons studio"),
      ...(offline
        ? []
        : [sceneChooser, button("Open", () => void begin(sceneChooser.value), "Open the scene"), run, step, stop, restart, resume, speedChooser]),
      status,
    ),
    el(
      "aside",
      { class: "left", "aria-label": "Bodies and view" },
      el("h2", {}, "Bodies"),
      bodyList,
      modeChoices(),
      el("h2", {}, "Colour by"),
      fieldChooser,
      el("div", { class: "hold" },
        button("Hold this range", () => {
          look.range = views[0].seenRange();
          restyle();
        }, "Hold the range of colours"),
        button("Free", () => {
          look.range = null;
          restyle();
        }, "Free the range of colours"),
      ),
      labelled("Contact forces", el("input", { type: "checkbox", checked: true, onchange: (e: Event) => {
        look.arrows = (e.target as HTMLInputElement).checked;
        restyle();
      } })),
      el("h2", {}, "Camera"),
      el("div", { class: "presets" },
        button("Fit", () => views[0].fit(), "Fit the view"),
        ...Object.keys(kPresets).map((name) => button(name === "Isometric" ? "iso" : name, () => views[0].turn(name), "View from " + name)),
      ),
    ),
    main,
    el("div", { class: "bottom" }, ...plots.map((p) => p.element)),
    el(
      "aside",
      { class: "right", "aria-label": "Scene and messages" },
      el("div", { class: "scroll" },
      ...(offline
        ? []
        : [
            section("Fields of the scene", true,
              el("div", { class: "hold" }, el("input", { type: "text", placeholder: "find a field", "aria-label": "Find a field", oninput: (e: Event) => {
                filter = (e.target as HTMLInputElement).value;
                if (scene) listFields();
              } }), undo),
              fieldTree,
              el("div", { class: "hold" }, saveName, button("Save the scene", () => void saveScene())),
            ),
            section("Holds", false, holds),
            section("Sets by picking", false, picking()),
            section("Led by hand", true, drives),
          ]),
      ),
      el("h2", {}, "Messages"),
      log,
    ),
    el(
      "footer",
      {},
      play,
      timeline,
      timeText,
      el("label", {}, "run ", runChooser),
      el("label", {}, "compare with ", compareChooser),
      el("label", {}, el("input", { type: "checkbox", onchange: (e: Event) => {
        difference = (e.target as HTMLInputElement).checked;
        changedRows = true;
      } }), " difference"),
      button("PNG", () => void exportAs("png"), "Export the view as PNG"),
      button("SVG", () => void exportAs("svg"), "Export the first plot as SVG"),
      button("CSV", () => void exportAs("csv"), "Export the columns as CSV"),
      ...(offline ? [] : [button("HTML", () => void exportAs("html"), "Export the run as one HTML file")]),
    ),
  );
}

document.addEventListener("keydown", (e) => {
  const at = e.target as HTMLElement;
  if (/^(INPUT|SELECT|TEXTAREA|BUTTON|SUMMARY)$/.test(at.tagName) || e.ctrlKey || e.metaKey || e.altKey) return;
  if (e.key === " ") {
    e.preventDefault();
    if (!run.disabled) void toggleRun();
  }
  if (e.key === "." && !step.disabled) void ask("step", { count: 1 });
  if (e.key === "f") views[0].fit();
  if (e.key === "[" || e.key === "]") {
    following = false;
    void showMoment(cursor + (e.key === "]" ? 1 : -1));
  }
});

/** Curves are drawn ten times a second at most: a step may take less than a millisecond. */
function refreshPlots() {
  if (changedRows) {
    changedRows = false;
    const runs = other && other !== shown ? [shown, other] : [shown];
    plots[0].show(runs, [shownForce(), ...kFirstColumns], difference);
    plots[1].show(runs, ["contacts", "certificate_error"], difference);
    tellStatus();
  }
  setTimeout(() => requestAnimationFrame(refreshPlots), 100);
}

function shownForce(): string {
  return [...shown.columns.keys()].find((c) => /_force_z$/.test(c)) ?? "push_force";
}

async function begun() {
  layOut();
  refreshPlots();
  showEngine("none");
  if (offline) {
    kept.push(offline);
    listRuns();
    setShown(offline);
    listRuns();
    return;
  }
  try {
    const state = await api.get("/api/state");
    root = state.root;
    [schema] = await Promise.all([api.get("/api/schema"), listFiles()]);
    void api.events(state.events, takeEvent, () => {
      ended = true;
      showEngine("ended");
      say("The server has ended. What was written stays; start amontons studio again to go on.", true);
    });
    void pullFrames();
    if (state.engine.state !== "none") {
      start = { scene: state.engine.scene.slice(root.length + 1), set: state.engine.set };
      showEngine(state.engine.state, state.engine.reason, state.engine.state === "failed", state.engine.saved_time);
      lastState = state.engine.state;
      await refreshScene();
    } else if (state.open.endsWith(".json")) {
      sceneChooser.value = state.open;
      await begin(state.open);
    } else if (state.open) {
      await chooseRun("folder:" + (state.open === "." ? "" : state.open), setShown);
    }
    listRuns();
  } catch (error) {
    say(`${(error as Error).message}. Open the address that amontons studio has printed, with all that stands after #.`, true);
  }
}

async function listFiles() {
  const list = await api.get("/api/list");
  folders = list.results;
  sceneChooser.replaceChildren(...list.scenes.map((s: string) => el("option", { value: s }, s)));
  listRuns();
}

// For tests, and for whoever writes programs with the page: what is shown, in numbers.
(window as any).studio = {
  get live() {
    return live;
  },
  get shown() {
    return shown;
  },
  get scene() {
    return scene;
  },
  get frames() {
    return views[0].frames;
  },
  picture: () => pictureOf().toDataURL("image/png"),
  valueAt: (path: string) => valueAt(scene, path),
};

void begun();
