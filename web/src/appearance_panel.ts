// Bodies, modes, colours, arrows, the cutting plane: the appearance of a view.

import { el, labelled, select } from "./dom";
import type { Instant } from "./frames";
import { app } from "./state";
import { kModes, type Arrows, type Cut, type Appearance, type Mode } from "./appearance";
import { arrangeViews, appearance, restyle, secondAppearance, views } from "./timeline";
import { kPresets } from "./view";
import { pace } from "./running";
import { shortNumber } from "./colours";

const bodyList = el("div");
const fieldChooser = el("div");
const secondChoosers = el("div");
let listed = "";

function bodyRow(name: string): HTMLElement {
  const mine = appearance.bodies.get(name) ?? { shown: true, mode: "" as const };
  appearance.bodies.set(name, mine);
  secondAppearance.bodies.set(name, mine); // a body that is left out is so in both
  const box = el("input", {
    type: "checkbox",
    checked: mine.shown,
    id: "show-" + name,
    onchange: () => {
      mine.shown = box.checked;
      restyle();
    },
  });
  return el(
    "div",
    { class: "body" },
    box,
    el("label", { for: "show-" + name }, name),
    select(
      "Mode of " + name,
      [["", "as all"], ...kModes.filter(([m]) => m !== "xray")] as [string, string][],
      mine.mode,
      (v) => {
        mine.mode = v as Mode | "";
        restyle();
      },
    ),
  );
}

const kStress = "von Mises stress";

function colourChoice(label: string, of: Appearance, fields: string[]): HTMLElement {
  if (!fields.includes(of.field)) of.field = fields.includes(kStress) ? kStress : "";
  return select(label, [["", "nothing"], ...fields.map((f) => [f, f] as [string, string])], of.field, (v) => {
    of.field = v;
    of.range = null;
    restyle();
  });
}

export function listBodies(instant: Instant) {
  const fields = [...new Set(instant.bodies.flatMap((b) => b.fields.map((f) => f.name)))];
  const key = instant.bodies.map((b) => b.name).join() + "|" + fields.join();
  if (key === listed) return;
  listed = key;
  bodyList.replaceChildren(...instant.bodies.map((b) => bodyRow(b.name)));
  fieldChooser.replaceChildren(colourChoice("Colour by", appearance, fields));
  secondChoosers.replaceChildren(
    labelled(
      "Mode",
      select("Mode of the second view", kModes as [string, string][], secondAppearance.mode, (v) => {
        secondAppearance.mode = v as Mode;
        restyle();
      }),
    ),
    labelled("Colour", colourChoice("Colour of the second view", secondAppearance, fields)),
  );
}

export function clearBodies() {
  appearance.bodies.clear();
  secondAppearance.bodies.clear();
  listed = "";
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
          checked: appearance.mode === mode,
          onchange: () => {
            appearance.mode = mode;
            xrayControls.hidden = mode !== "xray";
            restyle();
          },
        });
        return el("span", {}, radio, " ", el("label", { for: "mode-" + mode }, text));
      }),
    ),
  );
}

const button = (text: string, click: () => void, label = text) =>
  el("button", { onclick: click, "aria-label": label }, text);

function numberField(label: string, value: number, unit: string, change: (v: number) => void): HTMLElement {
  const input = el("input", {
    type: "text",
    inputmode: "decimal",
    value: String(value),
    "aria-label": label,
    onchange: () => {
      const v = Number(input.value);
      if (Number.isFinite(v)) change(v);
      else input.value = String(value);
    },
  });
  return el("div", { class: "row short" }, el("span", {}, label), input, el("span", { class: "unit" }, unit));
}

const angles = { around: 0, tilt: 0 };
const turn = () => views[0].turnTo(angles.around, angles.tilt);
const xrayControls = el(
  "div",
  { hidden: true },
  el("h2", {}, "X-ray"),
  numberField("C-arm angle", 0, "°", (v) => ((angles.around = v), turn())),
  numberField("C-arm tilt", 0, "°", (v) => ((angles.tilt = v), turn())),
  numberField("Attenuation of wires", 2000, "1/m", (v) => {
    for (const view of views) view.attenuation = Math.max(0, v);
    restyle();
  }),
  check("Vessels and solids, too", true, (on) => {
    for (const view of views) view.tissue = on;
    restyle();
  }),
  check("7.5 images a second", false, (on) => (pace.least = on ? 1000 / 7.5 : 30)),
);

function check(text: string, checked: boolean, change: (on: boolean) => void): HTMLElement {
  const box = el("input", { type: "checkbox", checked, onchange: () => change(box.checked) });
  return labelled(text, box);
}

function arrowControls(): HTMLElement {
  const change = (more: Partial<Arrows>) => {
    for (const l of [appearance, secondAppearance]) Object.assign(l.arrows, more);
    restyle();
  };
  return el(
    "div",
    {},
    check("Contact forces", true, (shown) => change({ shown })),
    select(
      "Part of the forces",
      [
        ["force", "whole force"],
        ["normal", "normal part"],
        ["friction", "friction"],
      ],
      "force",
      (part) => change({ part: part as Arrows["part"] }),
    ),
    check("On the other body", false, (other) => change({ other })),
    numberField("Join within", 0, "m", (v) => change({ within: Math.max(0, v) })),
  );
}

function cutControls(): HTMLElement {
  const readout = el("output", { "aria-label": "Place of the cutting plane" });
  let above = false; // what lies there is kept
  let other = false;
  const slider = el("input", { type: "range", min: 0, max: 1, step: 0.005, value: 0.5, disabled: true, "aria-label": "Cutting plane along the axis" });
  const change = (more: Partial<Cut>) => {
    for (const l of [appearance, secondAppearance]) Object.assign(l.cut, more);
    slider.disabled = appearance.cut.axis === "";
    restyle();
    const at = views[0].cutPlace();
    readout.textContent = at === null ? "" : `${appearance.cut.axis} = ${shortNumber(at)} m`;
  };
  slider.addEventListener("input", () => change({ share: Number(slider.value) }));
  return el(
    "div",
    {},
    select(
      "Cutting plane",
      [
        ["", "none"],
        ["x", "across x"],
        ["y", "across y"],
        ["z", "across z"],
      ],
      "",
      (axis) => {
        // The half towards the camera is cut off: else the cut is on the far side.
        above = axis !== "" && views[0].seesCutAbove(axis as "x" | "y" | "z");
        change({ axis: axis as Cut["axis"], flip: above !== other });
      },
    ),
    slider,
    readout,
    check("Keep the other side", false, (on) => {
      other = on;
      change({ flip: above !== other });
    }),
  );
}

function viewChoice(main: HTMLElement): HTMLElement {
  const mine = el("div", { hidden: true }, secondChoosers);
  const chooser = select(
    "Views",
    [
      ["one", "one"],
      ["two", "two side by side"],
    ],
    "one",
    (v) => {
      app.two = v === "two";
      mine.hidden = !app.two;
      arrangeViews(main);
    },
  );
  return el("div", {}, chooser, mine);
}

export function appearancePanel(main: HTMLElement): HTMLElement {
  return el(
    "aside",
    { class: "left", "aria-label": "Bodies and view" },
    el("h2", {}, "Bodies"),
    bodyList,
    modeChoices(),
    xrayControls,
    el("h2", {}, "Colour by"),
    fieldChooser,
    el(
      "div",
      { class: "hold" },
      button(
        "Hold range",
        () => {
          appearance.range = views[0].seenRange();
          restyle();
        },
        "Hold the range of colours",
      ),
      button(
        "Free",
        () => {
          appearance.range = null;
          restyle();
        },
        "Free the range of colours",
      ),
    ),
    el("h2", {}, "Camera"),
    el(
      "div",
      { class: "presets" },
      button("Fit", () => views[0].fit(), "Fit the view"),
      ...Object.keys(kPresets).map((name) =>
        button(name === "Isometric" ? "iso" : name, () => views[0].turn(name), "View from " + name),
      ),
    ),
    el("h2", {}, "Cutting plane"),
    cutControls(),
    el("h2", {}, "Arrows"),
    arrowControls(),
    el("h2", {}, "Views"),
    viewChoice(main),
  );
}

