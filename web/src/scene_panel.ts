// The scene: its fields, holds and named sets; what is changed, when it counts, and how it is taken back.

import * as api from "./api";
import { el, select } from "./dom";
import { editor } from "./editor";
import { app } from "./state";
import { request, showMessage } from "./messages";
import { setShown, views } from "./timeline";
import { clearBodies } from "./appearance_panel";
import { leadInputs } from "./drives";
import { offerHand } from "./haptic_panel";
import { shortNumber } from "./colours";

export { leadInputs as listDrives };

const kSetNames: Record<string, string[]> = {
  box: ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"],
  ball: ["outer"],
  cylinder: ["start", "end", "outer"],
  tube: ["inner", "outer", "start", "end"],
};

const fieldTree = el("div");
const holds = el("div");
const shownSets = el("div");
let filter = "";
let undoList: { path: string; old: any; set?: string[] }[] = []; // set: of the start before it

interface NamedSet {
  body: string;
  name: string;
  faces?: number[];
  points?: number[];
}
let sets: NamedSet[] = [];

export async function refreshScene() {
  const [answer, inputs, state] = await Promise.all([
    api.command("scene"),
    api.command("inputs"),
    api.get("/api/state").catch(() => null),
  ]);
  if (!answer.ok) return;
  app.scene = answer.scene;
  app.live.scene = app.scene;
  if (state) app.start.set = state.engine.set;
  listFields();
  offerHand();
  if (inputs.ok) leadInputs(inputs.inputs);
  const named = app.device ? { ok: false } : await api.command("sets");
  sets = named.ok ? (named as any).sets : [];
  listHolds();
  listSets();
}

function listFields() {
  const open = new Set([...fieldTree.querySelectorAll("details[open] > summary")].map((s) => s.textContent));
  const first = fieldTree.childElementCount === 0;
  const focus = (document.activeElement as HTMLElement | null)?.dataset?.path;
  const tree = editor(app.scene, app.schema, filter, (path, value, old) => void setField(path, value, old));
  if (!first && !filter)
    for (const d of tree.querySelectorAll("details")) d.open = open.has(d.firstElementChild!.textContent);
  fieldTree.replaceChildren(tree);
  if (focus) fieldTree.querySelector<HTMLElement>(`[data-path="${CSS.escape(focus)}"]`)?.focus();
}

// ---- changes

/** A field of the scene, between two steps; what does not fit the state needs a new start, which is offered. */
export async function setField(path: string, value: any, old: any, undoing = false): Promise<boolean> {
  const answer = await api.command("set", { path, value });
  if (answer.ok) {
    if (!undoing) undoList.push({ path, old });
    undo.disabled = undoList.length === 0;
    const text = `${path} is ${JSON.stringify(value)}`;
    if (answer.pending) showMessage(`${text} as soon as it is made ready: until then the hand feels the scene as it was`);
    else if (!answer.step) showMessage(`${text} from the beginning on`);
    else showMessage(`${text} from step ${answer.step.number + 1} on, after t = ${shortNumber(answer.time)} s`);
    return true;
  }
  // Bodies of another make cannot continue from the state of these: that needs a new start.
  if ((answer.issues ?? []).some((i) => i.file === "checkpoint")) {
    const again = async () => {
      const undone = [...undoList, { path, old, set: app.start.set }];
      await begin(app.start.scene, [...app.start.set, `${path}=${JSON.stringify(value)}`]);
      undoList = undone;
      undo.disabled = false;
    };
    if ((app.live.times.at(-1) ?? 0) === 0) {
      showMessage(`${path} is changed: started again with it`);
      await again();
      return true;
    }
    showMessage(`${path} needs a new start. `, false, el("button", { onclick: () => void again() }, "Start again with it"));
    listFields();
    return false;
  }
  showMessage(`${path}: ${api.issueText(answer.issues)}`, true);
  listFields();
  return false;
}

/** The result of a requested change of a haptic run. */
export function showChange(event: { line: string; ok: boolean; time: number; found: string }) {
  if (event.ok) showMessage(`${event.line}: in the hand from t = ${shortNumber(event.time)} s on`);
  else showMessage(`${event.line}: not changed: ${event.found}`, true);
  void refreshScene();
}

const undo = el(
  "button",
  {
    disabled: true,
    onclick: async () => {
      const last = undoList.pop();
      const rest = undoList;
      if (last?.set) {
        await begin(app.start.scene, last.set);
        undoList = rest;
      } else if (last) await setField(last.path, last.old, null, true);
      undo.disabled = undoList.length === 0;
    },
  },
  "Undo",
);

export async function begin(path: string, set: string[] = []) {
  app.start = { scene: path, set };
  undoList = [];
  undo.disabled = true;
  clearBodies();
  app.following = true;
  setShown(app.live);
  await request("start", { scene: path, set });
}

// ---- holds and sets

function setNames(name: string, body: any): string[] {
  const known = sets.filter((s) => s.body === name).map((s) => s.name);
  return [...new Set([...known, ...(kSetNames[body.mesh?.generate] ?? []), ...Object.keys(body.sets ?? {}), "all"])];
}

function solids(): [string, any][] {
  return Object.entries(app.scene?.bodies ?? {}).filter(([, b]: [string, any]) => b.kind === "solid") as [string, any][];
}

function listHolds() {
  holds.replaceChildren(
    ...solids().map(([name, body]) => {
      const list: any[] = body.hold ?? [];
      const names = setNames(name, body);
      const chooser = select("Set of " + name, names.map((s) => [s, s]), names[0], () => {});
      const change = (next: any[]) => void setField(`bodies.${name}.hold`, next, list);
      const free = (i: number) => change(list.filter((_, k) => k !== i));
      return el(
        "div",
        {},
        el("h2", {}, name),
        ...list.map((h, i) =>
          el(
            "div",
            { class: "hold" },
            el("span", {}, `${h.set}: ${["x", "y", "z"].filter((a) => a in h).join(", ") || "nothing"} held`),
            el("button", { "aria-label": `Free ${h.set} of ${name}`, onclick: () => free(i) }, "Free"),
          ),
        ),
        el(
          "div",
          { class: "hold" },
          chooser,
          el(
            "button",
            {
              "aria-label": `Hold the set of ${name}`,
              onclick: () => change([...list, { set: chooser.value, x: 0, y: 0, z: 0 }]),
            },
            "Hold",
          ),
        ),
      );
    }),
  );
}

let shownSet = "";
function listSets() {
  const key = (s: NamedSet) => `${s.body}: ${s.name}`;
  const options = sets.map((s) => [key(s), `${key(s)} (${(s.faces ?? s.points)!.length} ${s.faces ? "faces" : "points"})`] as [string, string]);
  if (!options.some(([k]) => k === shownSet)) shownSet = "";
  const show = () => {
    const s = sets.find((x) => key(x) === shownSet);
    const body = s && views[0].bodyNamed(s.body);
    if (!s || !body) return views[0].mark(null);
    const faces = new Set(s.faces);
    const points = new Set(s.points);
    const within = (t: number) =>
      s.faces ? faces.has(body.faces?.[t] ?? -1) : [0, 1, 2].every((k) => points.has(body.triangles[3 * t + k]));
    const triangles = Array.from({ length: body.triangles.length / 3 }, (_, t) => t).filter(within);
    views[0].mark(body, triangles);
  };
  shownSets.replaceChildren(
    select("Show the set", [["", "none"], ...options], shownSet, (v) => {
      shownSet = v;
      show();
    }),
  );
}

// ---- the panel

const saveName = el("input", { type: "text", "aria-label": "File of the scene", value: "changed.json" });
async function saveScene() {
  const scene = app.start.scene;
  const folder = scene.includes("/") ? scene.slice(0, scene.lastIndexOf("/") + 1) : "";
  const answer = await request("save_scene", { path: folder + saveName.value, scene: app.scene });
  if (answer.ok) showMessage("written: " + answer.path);
}

export function fieldPanel(): HTMLElement[] {
  const find = el("input", {
    type: "text",
    placeholder: "find a field",
    "aria-label": "Find a field",
    oninput: () => {
      filter = find.value;
      if (app.scene) listFields();
    },
  });
  return [
    el("div", { class: "hold" }, find, undo),
    fieldTree,
    el("div", { class: "hold" }, saveName, el("button", { onclick: () => void saveScene() }, "Save the scene")),
  ];
}

export function holdPanel(): HTMLElement[] {
  return [shownSets, holds];
}
