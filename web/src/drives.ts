// What is led by hand: sliders, their keys, and the axes of a gamepad.

import { el, select } from "./dom";
import { request } from "./messages";
import { shortNumber } from "./colours";

export interface Input {
  name: string;
  unit: string;
  least: number | null;
  largest: number | null;
  value: number;
}

interface Driven {
  input: Input;
  slider: HTMLInputElement;
  low: number;
  high: number;
  value: number; // as it was sent; the slider shows the nearest of its steps
  to: (value: number) => void;
}

export const drives = el("div");
let driven: Driven[] = [];
const kPause = 40; // between two values that are sent [ms]

/** Values are sent one at a time, the newest only. */
function sender(name: string): (value: number) => void {
  let waiting = false;
  let next: number | null = null;
  return async (value) => {
    next = value;
    if (waiting) return;
    waiting = true;
    while (next !== null) {
      const now: number = next;
      next = null;
      await request("set", { path: name, value: now });
      await new Promise((r) => setTimeout(r, kPause));
    }
    waiting = false;
  };
}

function driveOf(input: Input): { driven: Driven; element: HTMLElement } {
  const span = input.unit === "rad" ? Math.PI : input.unit === "m" ? 0.02 : Math.max(1, Math.abs(input.value));
  const low = input.least ?? input.value - span;
  const high = input.largest ?? input.value + span;
  const sendValue = sender(input.name);
  const send = (value: number) => {
    made.value = value;
    sendValue(value);
  };
  const slider = el("input", {
    type: "range",
    min: low,
    max: high,
    step: (high - low) / 1000,
    value: input.value,
    "aria-label": input.name,
    oninput: () => {
      text.value = shortNumber(Number(slider.value));
      send(Number(slider.value));
    },
  });
  const text = el("input", {
    type: "text",
    value: shortNumber(input.value),
    "aria-label": `Value of ${input.name}`,
    onchange: () => {
      if (!Number.isFinite(Number(text.value))) return void (text.value = slider.value);
      slider.value = text.value;
      send(Number(text.value));
    },
  });
  const to = (value: number) => {
    slider.value = String(value);
    text.value = shortNumber(value);
    send(value);
  };
  const made: Driven = { input, slider, low, high, value: input.value, to };
  return {
    driven: made,
    element: el("div", {}, el("h2", {}, `${input.name} [${input.unit}]`), el("div", { class: "row" }, slider, text)),
  };
}

export function leadInputs(inputs: Input[]) {
  const made = inputs.map(driveOf);
  driven = made.map((m) => m.driven);
  drives.replaceChildren(
    ...made.map((m) => m.element),
    ...(inputs.length === 0 ? [el("p", { class: "hint" }, "This scene has nothing that can be led by hand.")] : [gamepadChoice()]),
  );
}

// ---- gamepad

const kDead = 0.12; // of a released stick
const kSpeed = 0.25; // of an input's range in a second, at full deflection
const chosen: [string, string] = ["", ""]; // inputs of the two axes of the left stick
let polling = false;

function gamepadChoice(): HTMLElement {
  const names = driven.map((d) => d.input.name);
  const fits = (k: number) => (names.includes(chosen[k]) ? chosen[k] : "");
  const chooser = (k: 0 | 1, text: string) =>
    el(
      "div",
      { class: "row" },
      el("span", {}, text),
      select(`Gamepad, ${text}`, [["", "nothing"], ...names.map((n) => [n, n] as [string, string])], fits(k), (v) => {
        chosen[k] = v;
        if (!polling && (chosen[0] || chosen[1])) poll(performance.now());
      }),
    );
  return el(
    "div",
    {},
    el("h2", {}, "Gamepad"),
    chooser(0, "left stick, right"),
    chooser(1, "left stick, up"),
  );
}

function poll(before: number) {
  polling = chosen[0] !== "" || chosen[1] !== "";
  if (!polling) return;
  const now = performance.now();
  const pad = navigator.getGamepads?.().find((p) => p?.connected);
  const axes = pad ? [pad.axes[0] ?? 0, -(pad.axes[1] ?? 0)] : [0, 0];
  axes.forEach((a, k) => {
    const d = driven.find((x) => x.input.name === chosen[k]);
    if (!d || Math.abs(a) < kDead) return;
    const by = (a - Math.sign(a) * kDead) * kSpeed * (d.high - d.low) * Math.min(0.1, (now - before) / 1000);
    d.to(Math.min(d.high, Math.max(d.low, d.value + by)));
  });
  setTimeout(() => poll(now), 30);
}
