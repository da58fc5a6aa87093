// The page of amontons studio: how its parts are arranged, and how it begins.

import * as api from "./api";
import { el } from "./dom";
import { valueAt } from "./editor";
import { app, belowRoot, offline } from "./state";
import { log, showMessage } from "./messages";
import { Plot } from "./plots";
import { openResults } from "./runs";
import {
  counts,
  pause,
  pullFrames,
  restart,
  resume,
  run,
  setLastState,
  showEngine,
  speedChooser,
  status,
  step,
  stop,
  takeEvent,
  showStatus,
  toggleRun,
} from "./running";
import { listTimeline, moveBy, play, plots, setShown, timeline, timeText, views } from "./timeline";
import { appearancePanel } from "./appearance_panel";
import { begin, fieldPanel, holdPanel, refreshScene } from "./scene_panel";
import { listenForPicks, measurePanel, pickPanel } from "./picking";
import { drives } from "./drives";
import { hapticPanel } from "./haptic_panel";
import {
  compareChooser,
  exportButtons,
  continueButton,
  listFiles,
  listRuns,
  offerUnfinished,
  openFolder,
  pictureOf,
  runChooser,
} from "./runs_panel";

export const sceneChooser = el("select", { "aria-label": "Scene" });
export const main = el("main", {}, views[0].element);
let difference = false;

function section(title: string, open: boolean, ...inside: Node[]): HTMLElement {
  return el("details", { open }, el("summary", {}, title), ...inside);
}

function layOut() {
  const open = el("button", { onclick: () => void begin(sceneChooser.value), "aria-label": "Open the scene" }, "Open");
  const differenceBox = el("input", {
    type: "checkbox",
    onchange: () => {
      difference = differenceBox.checked;
      app.changedRows = true;
    },
  });
  document.body.replaceChildren(
    el(
      "header",
      {},
      el("h1", {}, "amontons studio"),
      ...(offline ? [] : [sceneChooser, open, run, pause, step, stop, resume, restart, speedChooser]),
      status,
    ),
    appearancePanel(main),
    main,
    el("div", { class: "bottom" }, ...plots.map((p: Plot) => p.element)),
    el(
      "aside",
      { class: "right", "aria-label": "Scene and messages" },
      el(
        "div",
        { class: "scroll" },
        ...(offline
          ? []
          : [
              section("Fields of the scene", true, ...fieldPanel()),
              section("Holds", false, ...holdPanel()),
              section("Sets by picking", false, ...pickPanel()),
            ]),
        section("Distances", false, ...measurePanel()),
        ...(offline ? [] : [section("Led by hand", true, drives), section("In the hand", false, hapticPanel())]),
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
      el("label", {}, "shown ", runChooser),
      ...(offline ? [] : [continueButton]),
      el("label", {}, "compare with ", compareChooser),
      el("label", {}, differenceBox, " difference"),
      ...exportButtons(),
    ),
  );
}

document.addEventListener("keydown", (e) => {
  const at = e.target as HTMLElement;
  if (/^(INPUT|SELECT|TEXTAREA|BUTTON|SUMMARY)$/.test(at.tagName) || e.ctrlKey || e.metaKey || e.altKey) return;
  if (e.key === " ") {
    e.preventDefault();
    if (!run.disabled || !pause.disabled) void toggleRun();
  }
  if (e.key === "." && !step.disabled) step.click();
  if (e.key === "f") views[0].fit();
  if (e.key === "[" || e.key === "]") moveBy(e.key === "]" ? 1 : -1);
});

const kPlotPause = 100; // [ms]: a step may take less than a millisecond
const kPlotPauseRunning = 500; // [ms]: without a GPU two plots cost as much as a view
const kFirstColumns = ["push_force", "hand_force", "contacts", "certificate_error"];

function refreshPlots() {
  if (app.changedRows) {
    app.changedRows = false;
    const runs = app.other && app.other !== app.shown ? [app.shown, app.other] : [app.shown];
    const force = [...app.shown.columns.keys()].find((c) => /_force_z$/.test(c) && !c.startsWith("hand")) ?? "";
    const push = [...app.shown.columns.keys()].find((c) => /_push_force$/.test(c)) ?? "";
    plots[0].show(runs, [force, push, ...kFirstColumns], difference);
    plots[1].show(runs, ["device_from_handle", "contacts", "certificate_error"], difference);
    showStatus();
  }
  setTimeout(() => requestAnimationFrame(refreshPlots), app.engine === "running" ? kPlotPauseRunning : kPlotPause);
}

/** A simulation that was there before this page: what it has written is what it has done. */
async function takeOver(engine: any) {
  app.start = { scene: belowRoot(engine.scene), set: engine.set };
  app.device = engine.device ?? "";
  app.folder = belowRoot(engine.folder ?? "");
  sceneChooser.value = app.start.scene;
  const failed = engine.state === "failed" || engine.state === "stopped";
  showEngine(engine.state, engine.reason, failed, engine.saved_time);
  setLastState(engine.state);
  if (app.folder) {
    const before = await openResults(app.folder).catch(() => null);
    if (before) {
      app.live.columns = before.columns;
      app.live.units = before.units;
      app.live.moments = before.moments;
      app.live.scene = before.scene;
      showMessage(`this simulation was there before the page: ${app.live.times.length} steps of it are in ${app.folder}`);
      app.changedRows = true;
      listTimeline();
    }
  }
  if (!failed) await refreshScene();
}

async function begun() {
  layOut();
  listenForPicks();
  refreshPlots();
  showEngine("none");
  if (offline) {
    app.kept.push(offline);
    setShown(offline);
    listRuns();
    return;
  }
  try {
    const state = await api.get("/api/state");
    app.root = state.root;
    [app.schema] = await Promise.all([api.get("/api/schema"), listFiles()]);
    void api.events(state.events, takeEvent, () => {
      app.ended = true;
      const where = app.folder ? ` The run is in ${app.folder}: "amontons studio ${app.folder}" continues from its end.` : "";
      showEngine("ended");
      showMessage("The server has ended. What was written stays; start amontons studio again to continue." + where, true);
    });
    void pullFrames();
    if (state.engine.state !== "none") {
      await takeOver(state.engine);
    } else if (state.open.endsWith(".json")) {
      sceneChooser.value = state.open;
      await begin(state.open);
    } else if (state.open) {
      await openFolder(state.open === "." ? "" : state.open);
    }
    listRuns();
    if (state.engine.state === "none") await offerUnfinished();
  } catch (error) {
    showMessage(
      `${(error as Error).message}. Open the address that amontons studio has printed, with all that stands after #.`,
      true,
    );
  }
}

// For tests, and for whoever writes programs with the page: what is shown, in numbers.
(window as any).studio = {
  get live() {
    return app.live;
  },
  get shown() {
    return app.shown;
  },
  get scene() {
    return app.scene;
  },
  get health() {
    return app.health;
  },
  get frames() {
    return views[0].frames;
  },
  get folder() {
    return app.folder;
  },
  /** Of this page, so far: steps that were reported, instants that were kept. */
  get steps() {
    return counts.steps;
  },
  get instants() {
    return counts.instants;
  },
  /** Mean time to unpack a frame [ms]. */
  get unpacking() {
    return counts.unpacking / Math.max(1, counts.instants);
  },
  views,
  picture: () => pictureOf().toDataURL("image/png"),
  valueAt: (path: string) => valueAt(app.scene, path),
};

void begun();
