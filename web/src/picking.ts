// Sets by picking, and distances that are measured: by the mouse, or by keys with a cross in the view.

import { el, labelled, select } from "./dom";
import type { Body } from "./frames";
import { app } from "./state";
import { showMessage } from "./messages";
import { setField } from "./scene_panel";
import { views } from "./timeline";
import {
  boxOf,
  centreOf,
  facesOf,
  grow,
  inBox,
  inPlane,
  inPolygon,
  normalOf,
  type Polygon,
  type Vec,
} from "./sets";
import { lengthText, shortNumber } from "./colours";
import type { Place } from "./view";

type PickMode = "" | "grow" | "plane" | "box" | "lasso" | "measure";
let mode: PickMode = "";
let angle = 30; // [degree]
let picked: { body: Body; set: any } | null = null;
const view = () => views[0];

const readout = el("output", { class: "hint", "aria-label": "Picked faces" });
const setName = el("input", { type: "text", value: "picked", "aria-label": "Name of the set" });
const rubber = el("div", { class: "rubber", hidden: true });

function setMode(next: PickMode) {
  mode = next;
  polygon = [];
  view().outline = [];
  view().interactive = mode !== "box" && mode !== "lasso";
  view().cross = mode === "" ? null : middle();
  view().draw();
}

const middle = (): [number, number] => [view().element.clientWidth / 2, view().element.clientHeight / 2];

// ---- sets

/** From a place of the view to one of the mesh: scenes name places before `start` has moved the body. */
function meshPlace(name: string, p: Vec): Vec {
  const { place = [0, 0, 0] } = app.scene?.bodies?.[name]?.start ?? {};
  return turnedBack(name, p.map((v, k) => v - place[k]) as Vec);
}

function turnedBack(name: string, x: Vec): Vec {
  const turn = (app.scene?.bodies?.[name]?.start?.turn ?? [0, 0, 0]) as Vec;
  const a = Math.hypot(...turn);
  if (a === 0) return x;
  const n = turn.map((v) => v / a) as Vec; // Rodrigues, backwards
  const c = Math.cos(a);
  const s = -Math.sin(a);
  const d = n[0] * x[0] + n[1] * x[1] + n[2] * x[2];
  const w = [n[1] * x[2] - n[2] * x[1], n[2] * x[0] - n[0] * x[2], n[0] * x[1] - n[1] * x[0]];
  return x.map((v, k) => v * c + w[k] * s + n[k] * d * (1 - c)) as Vec;
}

const isTurned = (name: string) =>
  Math.hypot(...((app.scene?.bodies?.[name]?.start?.turn ?? [0, 0, 0]) as Vec)) > 0;

/** The body as the scene begins: its places are those that sets are written with. */
function atStart(body: Body): Body | null {
  const points = app.shown === app.live ? app.frames.startOf(body.name) : undefined;
  return points?.length === body.points.length ? { ...body, points } : null;
}

const kNoStart = "where the scene begins this body was not seen: press To the beginning, or pick by a lasso";

const round = (x: number) => Number(x.toPrecision(6));

function setPicked(body: Body, triangles: number[], set: any) {
  picked = { body, set };
  view().mark(body, triangles);
  readout.textContent = `${triangles.length} triangles of ${body.name}`;
  makeSet.disabled = triangles.length === 0;
}

function pickFace(x: number, y: number) {
  const hit = view().pick(x, y, true);
  if (!hit) return;
  const begun = atStart(hit.body);
  if (!begun) return showMessage(kNoStart, true);
  const name = hit.body.name;
  // The middle of the triangle, well inside of the face that is meant.
  const at = meshPlace(name, centreOf(begun, hit.triangle)).map(round);
  if (mode === "grow") return setPicked(hit.body, grow(begun, hit.triangle, angle), { faces_like: { at, angle } });
  const normal = normalOf(begun, hit.triangle);
  const found = inPlane(begun, hit.triangle);
  setPicked(hit.body, found.triangles, {
    plane: { at, normal: turnedBack(name, normal).map(round) },
    within: round(found.within),
  });
}

function pickBox(x0: number, y0: number, x1: number, y1: number) {
  const hit = view().pick((x0 + x1) / 2, (y0 + y1) / 2, true);
  if (!hit) return showMessage("the middle of the box is on no solid", true);
  const name = hit.body.name;
  if (isTurned(name)) return showMessage("boxes lie along the axes of the mesh, and this body starts turned: take a lasso", true);
  const begun = atStart(hit.body);
  if (!begun) return showMessage(kNoStart, true);
  const box = boxOf(begun, view().project(hit.body.points), [x0, y0, x1, y1]);
  if (!box) return;
  const [from, to] = box;
  setPicked(hit.body, inBox(begun, from, to), { box: { from: meshPlace(name, from), to: meshPlace(name, to) } });
}

/** Faces that are seen and lie whole in a polygon of the screen; written by their numbers. */
function pickLasso(polygon: Polygon) {
  const middle = polygon.reduce((a, p) => [a[0] + p[0] / polygon.length, a[1] + p[1] / polygon.length], [0, 0]);
  const hit = view().pick(middle[0], middle[1], true) ?? polygon.map((p) => view().pick(p[0], p[1], true)).find((h) => h);
  if (!hit) return showMessage("the lasso is around no solid", true);
  const { body } = hit;
  if (!body.faces) return showMessage("faces of a finished run have no numbers: pick in a live one", true);
  const seen = view().seenTriangles(body.name);
  const within = inPolygon(body, view().project(body.points), polygon);
  const faces = facesOf(body, within, seen);
  const selected = new Set(faces);
  const triangles = Array.from({ length: body.triangles.length / 3 }, (_, t) => t).filter((t) => selected.has(body.faces![t]));
  setPicked(body, triangles, { faces });
}

const makeSet = el(
  "button",
  {
    disabled: true,
    onclick: async () => {
      if (!picked) return;
      const name = picked.body.name;
      const sets = app.scene.bodies[name].sets ?? {};
      if (await setField(`bodies.${name}.sets`, { ...sets, [setName.value]: picked.set }, sets)) {
        view().mark(null);
        picked = null;
        makeSet.disabled = true;
        readout.textContent = "";
      }
    },
  },
  "Make the set",
);

// ---- distances

let measured: Place[] = [];
const distance = el("output", { class: "hint", "aria-label": "Measured distance" });

function measureAt(x: number, y: number) {
  const hit = view().pick(x, y, false);
  if (!hit) return;
  if (measured.length === 2) measured = [];
  measured.push(hit);
  showMeasured();
}

/** Places are those of the bodies and move with them. */
export function showMeasured() {
  const points = measured.map((p) => view().placeNow(p)).filter((p) => p !== null) as Vec[];
  view().measure = points;
  view().draw();
  if (points.length < 2) {
    distance.textContent = points.length === 1 ? `from (${points[0].map(shortNumber).join(", ")}) m` : "";
    return;
  }
  const d = points[1].map((v, k) => v - points[0][k]);
  distance.textContent = `${lengthText(Math.hypot(...d))} (${d.map((v) => lengthSigned(v)).join(", ")})`;
}

const lengthSigned = (x: number) => (x === 0 ? "0" : (x < 0 ? "−" : "") + lengthText(Math.abs(x)));

// ---- mouse and keys

let down: [number, number] | null = null;
let polygon: Polygon = []; // of the lasso
const kMoved = 4; // pixels: more is no click
const kKeyStep = 4;

const placeOf = (e: PointerEvent): [number, number] => {
  const r = view().element.getBoundingClientRect();
  return [e.clientX - r.left, e.clientY - r.top];
};

function clickAt(x: number, y: number) {
  if (mode === "measure") measureAt(x, y);
  else if (mode === "grow" || mode === "plane") pickFace(x, y);
}

function showRubber(from: [number, number], to: [number, number]) {
  rubber.hidden = false;
  rubber.style.left = Math.min(from[0], to[0]) + "px";
  rubber.style.top = Math.min(from[1], to[1]) + "px";
  rubber.style.width = Math.abs(to[0] - from[0]) + "px";
  rubber.style.height = Math.abs(to[1] - from[1]) + "px";
}

const boxBetween = (a: [number, number], b: [number, number]) =>
  pickBox(Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[0], b[0]), Math.max(a[1], b[1]));

function closeLasso() {
  if (polygon.length > 2) pickLasso(polygon);
  polygon = [];
  view().outline = [];
  view().draw();
}

function onKey(e: KeyboardEvent) {
  const step = (e.shiftKey ? 5 : 1) * kKeyStep;
  const ways: Record<string, [number, number]> = {
    ArrowLeft: [-step, 0],
    ArrowRight: [step, 0],
    ArrowUp: [0, -step],
    ArrowDown: [0, step],
  };
  const cross = view().cross;
  if (!cross) return;
  const way = ways[e.key];
  if (way) {
    view().cross = [
      Math.min(view().element.clientWidth - 1, Math.max(0, cross[0] + way[0])),
      Math.min(view().element.clientHeight - 1, Math.max(0, cross[1] + way[1])),
    ];
    if (mode === "box" && keyCorner) showRubber(keyCorner, view().cross!);
  } else if (e.key === "Enter") {
    if (mode === "box") {
      if (keyCorner) boxBetween(keyCorner, cross);
      keyCorner = keyCorner ? null : cross;
      rubber.hidden = true;
    } else if (mode === "lasso") {
      polygon.push(cross);
      view().outline = polygon;
    } else clickAt(...cross);
  } else if (e.key === "Backspace" && mode === "lasso") {
    polygon.pop();
  } else if (e.key === " " && mode === "lasso") {
    closeLasso();
  } else if (e.key === "Escape") {
    keyCorner = null;
    polygon = [];
    view().outline = [];
    rubber.hidden = true;
  } else return;
  e.preventDefault();
  e.stopPropagation();
  view().draw();
}
let keyCorner: [number, number] | null = null;

export function listenForPicks() {
  view().element.append(rubber);
  const { canvas } = view();
  canvas.addEventListener("pointerdown", (e) => {
    if (!mode) return;
    down = placeOf(e);
    polygon = [];
    if (mode === "lasso" || mode === "box") canvas.setPointerCapture(e.pointerId);
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!down) return;
    const at = placeOf(e);
    if (mode === "box") showRubber(down, at);
    if (mode === "lasso") {
      polygon.push(at);
      view().outline = polygon;
      view().draw();
    }
  });
  canvas.addEventListener("pointerup", (e) => {
    const from = down;
    down = null;
    rubber.hidden = true;
    if (!from || !mode) return;
    const at = placeOf(e);
    if (mode === "box") boxBetween(from, at);
    else if (mode === "lasso") closeLasso();
    else if (Math.hypot(at[0] - from[0], at[1] - from[1]) < kMoved) clickAt(...at);
  });
  canvas.addEventListener("keydown", onKey);
}

const kHint =
  "In the view: click or drag. By keys: arrow keys move the cross (with Shift faster), Enter picks or sets a corner, Space closes a lasso.";

export function pickPanel(): HTMLElement[] {
  const angleField = el("input", {
    type: "text",
    value: angle,
    "aria-label": "Angle of growing",
    onchange: () => {
      angle = Math.min(180, Math.max(5, Number(angleField.value) || 30));
      angleField.value = String(angle);
    },
  });
  return [
    labelled(
      "Pick by",
      select(
        "Pick by",
        [
          ["", "nothing"],
          ["grow", "a click, and faces like it"],
          ["plane", "a click, and its plane"],
          ["box", "a box"],
          ["lasso", "a lasso"],
        ],
        "",
        (v) => {
          measuring.checked = false;
          setMode(v as PickMode);
        },
      ),
    ),
    labelled("Angle", angleField, el("span", { class: "unit" }, "°")),
    labelled("Name", setName),
    el("div", { class: "hold" }, makeSet, readout),
    el("p", { class: "hint" }, kHint),
  ];
}

const measuring = el("input", {
  type: "checkbox",
  onchange: () => {
    setMode(measuring.checked ? "measure" : "");
    if (!measuring.checked) measured = [];
    showMeasured();
  },
});

export function measurePanel(): HTMLElement[] {
  return [labelled("Measure a distance", measuring), distance];
}

