// Runs: which one is shown, which one it is compared with, and what leaves the page.

import * as api from "./api";
import { el, save } from "./dom";
import { app, offline } from "./state";
import { request, showMessage } from "./messages";
import { openResults, type Run } from "./runs";
import { arrangeViews, plots, second, setShown, showMoment, views } from "./timeline";
import { dataOf, exportPage } from "./export";
import { film } from "./film";
import { main, sceneChooser } from "./main";
import { clearBodies } from "./appearance_panel";
import { shortNumber } from "./colours";

const keyOf = (r: Run) => (r === app.live ? "live" : app.kept.includes(r) ? "kept:" + r.name : "folder:" + r.folder);
export const runChooser = el("select", {
  "aria-label": "Shown",
  onchange: () => void choose(runChooser.value, setShown),
});
export const compareChooser = el("select", {
  "aria-label": "Compare with",
  onchange: () => void choose(compareChooser.value, compareWith),
});
let folders: string[] = [];
let newest: string | undefined; // of them, the one written last
const openFolders = new Map<string, Run>();

export function listRuns() {
  const kept = app.kept.map((r) => ["kept:" + r.name, r.name] as [string, string]);
  const options: [string, string][] = offline
    ? kept
    : [["live", "live"], ...kept, ...folders.map((f) => ["folder:" + f, f] as [string, string])];
  runChooser.replaceChildren(...options.map(([v, t]) => el("option", { value: v }, t)));
  compareChooser.replaceChildren(
    el("option", { value: "" }, "nothing"),
    ...options.map(([v, t]) => el("option", { value: v }, t)),
  );
  compareChooser.value = app.other ? keyOf(app.other) : "";
  runChosen();
}

export function runChosen() {
  runChooser.value = keyOf(app.shown);
  continueButton.hidden = !canContinue(app.shown);
}

async function runOf(key: string): Promise<Run | null> {
  if (key === "live") return app.live;
  if (key.startsWith("kept:")) return app.kept.find((r) => "kept:" + r.name === key) ?? null;
  const folder = key.slice("folder:".length);
  let r = openFolders.get(folder);
  if (!r || r.status === "running") {
    r = await openResults(folder);
    openFolders.set(folder, r);
  }
  return r;
}

async function choose(key: string, take: (r: Run) => void) {
  try {
    const r = key ? await runOf(key) : null;
    if (r) take(r);
    else compareWith(null);
  } catch (error) {
    showMessage(String((error as Error).message), true);
    listRuns();
  }
}

export const openFolder = (folder: string) => choose("folder:" + folder, setShown);

function compareWith(r: Run | null) {
  app.other = r;
  arrangeViews(main);
}

export async function listFiles() {
  const list = await api.get("/api/list");
  folders = list.results;
  newest = list.newest;
  const was = sceneChooser.value;
  sceneChooser.replaceChildren(...list.scenes.map((s: string) => el("option", { value: s }, s)));
  if (list.scenes.includes(was)) sceneChooser.value = was;
  listRuns();
}

// ---- a run that was cut off

const canContinue = (r: Run) => r.folder !== "" && r.resumable && "folder:" + r.folder !== "folder:" + app.folder;
export const continueButton = el(
  "button",
  { hidden: true, onclick: () => void continueRun(app.shown.folder) },
  "Continue from its end",
);

export async function continueRun(folder: string) {
  clearBodies();
  const answer = await request("start", { folder });
  if (!answer.ok) return;
  app.following = true;
  setShown(app.live);
  showMessage(`${folder} is continued`);
}

/** After a server or a simulation that was killed: the last live run, where it has not reached its end. */
export async function offerUnfinished() {
  const last = newest && /-\d{3,}$/.test(newest) ? newest : null;
  const r = last ? await runOf("folder:" + last).catch(() => null) : null;
  if (!last || !r?.resumable) return;
  const how = r.status === "running" ? "was cut off" : "has not reached its end";
  const on = el("button", { onclick: () => void continueRun(last) }, "Continue it");
  showMessage(`${last} ${how}; what was written is there, up to t = ${shortNumber(r.times.at(-1) ?? 0)} s. `, false, on);
}

// ---- what leaves the page

export function pictureOf(): HTMLCanvasElement {
  const parts = (second() ? views : views.slice(0, 1)).map((v) => v.picture());
  if (parts.length === 1) return parts[0];
  const out = document.createElement("canvas");
  out.width = parts[0].width + parts[1].width;
  out.height = parts[0].height;
  const g = out.getContext("2d")!;
  g.drawImage(parts[0], 0, 0);
  g.drawImage(parts[1], parts[0].width, 0);
  return out;
}

const kFilmRate = 25; // pictures a second
const kMostPictures = 500;

async function exportFilm(name: string) {
  const { shown } = app;
  const count = Math.min(kMostPictures, shown.moments.length);
  if (count < 2) return showMessage("a film needs two instants at least", true);
  showMessage(`the film is being drawn: ${count} pictures`);
  app.following = false;
  const begin = shown.moments[0].time;
  const span = shown.moments[shown.moments.length - 1].time - begin;
  const blob = await film(count, kFilmRate, async (i) => {
    if (app.shown !== shown) throw new Error("another run is shown: the film was given up");
    await showMoment(shown.nearest(begin + (span * i) / (count - 1))); // evenly in time
    return pictureOf();
  });
  save(name + ".webm", blob);
  showMessage(`${name}.webm: ${span.toPrecision(3)} s of the run in ${(count / kFilmRate).toPrecision(3)} s`);
}

async function exportAs(what: string) {
  const name = (app.shown.name || "run").replace(/[^A-Za-z0-9_-]+/g, "_");
  try {
    if (what === "png") pictureOf().toBlob((b) => b && save(name + ".png", b));
    if (what === "svg") save(`${name}_${plots[0].column}.svg`, new Blob([plots[0].svg()], { type: "image/svg+xml" }));
    if (what === "csv") save(name + ".csv", new Blob([app.shown.csv()], { type: "text/csv" }));
    if (what === "film") await exportFilm(name);
    if (what === "html") {
      showMessage("the page is being written");
      save(name + ".html", await exportPage(await dataOf(app.shown)));
    }
  } catch (error) {
    showMessage(String((error as Error).message), true);
  }
}

export function exportButtons(): HTMLElement[] {
  const button = (text: string, what: string, label: string) =>
    el("button", { onclick: () => void exportAs(what), "aria-label": label }, text);
  return [
    button("PNG", "png", "Export the view as PNG"),
    button("SVG", "svg", "Export the first plot as SVG"),
    button("CSV", "csv", "Export the columns as CSV"),
    button("Film", "film", "Export a film"),
    ...(offline ? [] : [button("HTML", "html", "Export one HTML file")]),
  ];
}
