// The timeline, and the views that show an instant of it.

import { el } from "./dom";
import { app, newAppearance } from "./state";
import { showMessage } from "./messages";
import { showStatus } from "./running";
import { listBodies } from "./appearance_panel";
import { showMeasured } from "./picking";
import { runChosen } from "./runs_panel";
import { Plot } from "./plots";
import { View } from "./view";
import { shortNumber } from "./colours";

export const appearance = newAppearance();
export const secondAppearance = newAppearance();
export const views = [new View("View of the scene", appearance), new View("View of the run compared with", appearance)];
export const viewNames = views.map((v) => {
  const name = el("div", { class: "name" });
  v.element.append(name);
  return name;
});

export const timeline = el("input", { type: "range", min: 0, max: 0, value: 0, "aria-label": "Timeline" });
export const timeText = el("output", { "aria-label": "Time shown" });
export const plots = [new Plot("First plot", (t) => seekTime(t)), new Plot("Second plot", (t) => seekTime(t))];

/** The second view is there: of another run, or of the same one. */
export const second = () => app.two || app.other !== null;

export function restyle() {
  views[0].restyle();
  if (second()) views[1].restyle();
}

export function setShown(r: typeof app.shown) {
  if (app.shown === r) return;
  app.shown = r;
  app.cursor = -1;
  runChosen();
  app.changedRows = true;
  if (r.moments.length > 0) void showMoment(r === app.live ? r.moments.length - 1 : 0);
}

export function listTimeline() {
  timeline.max = String(Math.max(0, app.shown.moments.length - 1));
  timeline.value = String(Math.max(0, app.cursor));
}

let loading = 0;
export async function showMoment(index: number) {
  const { shown } = app;
  if (index < 0 || index >= shown.moments.length) return;
  const mine = ++loading;
  const instant =
    shown.moments[index].instant ?? (await shown.load(index).catch((e) => (showMessage(String(e.message), true), null)));
  if (mine !== loading || shown !== app.shown || !instant) return;
  app.cursor = index;
  app.instant = instant;
  listBodies(instant);
  views[0].show(instant);
  timeText.textContent = `t = ${shortNumber(instant.time)} s`;
  timeline.setAttribute("aria-valuetext", timeText.textContent);
  listTimeline();
  for (const p of plots) p.setTime(instant.time);
  showStatus();
  showMeasured();
  if (!second()) return;
  const there = app.other ? app.other.nearest(instant.time) : index;
  const beside = !app.other ? instant : there < 0 ? null : await app.other.load(there).catch(() => null);
  if (mine !== loading) return;
  const of = app.other ?? shown;
  viewNames[0].textContent = app.other ? `${shown.name}, t = ${shortNumber(instant.time)} s` : "";
  views[1].show(beside);
  if (app.other) views[0].restyle(); // one range of colours for both
  viewNames[1].textContent = !app.other
    ? ""
    : beside
      ? `${of.name}, t = ${shortNumber(beside.time)} s`
      : of.name + ": no pictures";
}

function isLast(index: number) {
  return app.shown === app.live && index === app.shown.moments.length - 1;
}

export function seekTime(time: number) {
  const at = app.shown.nearest(time);
  app.following = isLast(at);
  void showMoment(at);
}

export function moveBy(count: number) {
  app.following = false;
  void showMoment(app.cursor + count);
}

timeline.addEventListener("input", () => {
  const at = Number(timeline.value);
  app.following = isLast(at);
  void showMoment(at);
});

const kPlayed = 30; // instants a second, where drawing keeps up
let playing = false;
export const play = el("button", { onclick: () => void playOn(), "aria-pressed": "false" }, "Play");
async function playOn() {
  const show = (on: boolean) => {
    playing = on;
    play.textContent = on ? "Hold" : "Play";
    play.setAttribute("aria-pressed", String(on));
    for (const v of views) v.hurried = on;
  };
  show(!playing);
  if (playing && app.cursor >= app.shown.moments.length - 1) await showMoment(0);
  let due = performance.now();
  while (playing && app.cursor < app.shown.moments.length - 1) {
    // An instant that came late does not delay those after it; time that drawing has lost is not made up.
    due = Math.max(due + 1000 / kPlayed, performance.now());
    app.following = false;
    await showMoment(app.cursor + 1);
    await views[0].afterDrawing(); // frames faster than the screen are of no use
    await new Promise((r) => setTimeout(r, Math.max(0, due - performance.now())));
  }
  show(false);
}

let tying = false;
for (const [a, b] of [
  [0, 1],
  [1, 0],
])
  views[a].onCamera = () => {
    if (!second() || tying) return;
    tying = true;
    views[b].setCamera(views[a].getCamera(), views[a]);
    tying = false;
  };

/** After the second view was opened or closed. */
export function arrangeViews(into: HTMLElement) {
  const both = second();
  views[1].appearance = app.other ? appearance : secondAppearance;
  views[0].partner = app.other ? views[1] : null;
  views[1].partner = app.other ? views[0] : null;
  views[1].canvas.setAttribute(
    "aria-label",
    app.other ? "View of the run compared with" : "Second view of the scene",
  );
  if (both) into.append(views[1].element);
  else {
    views[1].element.remove();
    viewNames[0].textContent = "";
  }
  if (!app.other) views[0].restyle();
  app.changedRows = true;
  requestAnimationFrame(async () => {
    await showMoment(Math.max(0, app.cursor));
    if (second()) views[1].setCamera(views[0].getCamera(), views[0]);
  });
}
