// A run in the hand: how it is started, and the health of its loop.

import { el, labelled, select } from "./dom";
import { app, type Health } from "./state";
import { request } from "./messages";
import { setShown, views } from "./timeline";
import { shortNumber } from "./colours";

let device = "simulated";
let virtual = false;
const rest = el("input", { type: "text", value: "5005", "aria-label": "Port of the device" });
const restRow = labelled("Port", rest);
restRow.hidden = true;
const start = el("button", { onclick: () => void begin() }, "Start in the hand");
const startHint = el("p", { class: "hint" });

async function begin() {
  app.following = true;
  setShown(app.live);
  const name = device === "udp" ? `udp:${rest.value.trim()}` : device;
  await request("start", { scene: app.start.scene, set: app.start.set, device: name, virtual_time: virtual });
}

// ---- what is shown of the loop

const rows: [string, (h: Health) => string][] = [
  ["State", (h) => h.state + (h.reason ? `: ${h.reason}` : "")],
  ["Rate", (h) => `${h.rate.toFixed(0)} of ${h.rate_aim.toFixed(0)} Hz`],
  ["Missed ticks", (h) => `${h.missed} of ${h.ticks + h.missed}, by its own work ${h.missed_by_work}`],
  ["p99 of a tick", (h) => `${(1e6 * h.p99).toFixed(0)} µs`],
  ["p99 of lateness", (h) => `${(1e6 * h.late_p99).toFixed(0)} µs`],
  ["Energy given to the hand", (h) => `${shortNumber(1e3 * h.energy)} mJ`],
  ["Force in the hand", (h) => `${shortNumber(Math.hypot(...h.force))} N (${h.force.map(shortNumber).join(", ")})`],
  ["Device's place", (h) => placeText(h.device)],
  ["Handle's place", (h) => placeText(h.handle)],
  ["Device from handle", (h) => `${shortNumber(1e3 * Math.hypot(...h.device.map((x, k) => x - h.handle[k])))} mm`],
  ["Simulation's rate", (h) => (h.step_rate === undefined ? "" : `${h.step_rate.toFixed(0)} of ${h.step_rate_aim.toFixed(0)} steps a second`)],
  ["Contacts handed over", (h) => String(h.contacts)],
];
const placeText = (p: number[]) => `(${p.map((x) => (1e3 * x).toFixed(2)).join(", ")}) mm`;
const cells = rows.map(([name]) => el("output", { "aria-label": name }));
const table = el(
  "div",
  { role: "group", "aria-label": "Loop's health", class: "health", hidden: true },
  ...rows.flatMap(([name], i) => [el("span", { class: "unit" }, name), cells[i]]),
);

const kColumns: [string, string, (h: Health) => number][] = [
  ["hand_force", "N", (h) => Math.hypot(...h.force)],
  ["hand_force_x", "N", (h) => h.force[0]],
  ["hand_force_y", "N", (h) => h.force[1]],
  ["hand_force_z", "N", (h) => h.force[2]],
  ["device_from_handle", "m", (h) => Math.hypot(...h.device.map((x, k) => x - h.handle[k]))],
  ["energy_to_hand", "J", (h) => h.energy],
  ["loop_rate", "Hz", (h) => h.rate],
  ["tick_p99", "s", (h) => h.p99],
  ["missed_ticks", "", (h) => h.missed],
  ["simulation_rate", "1/s", (h) => h.step_rate ?? NaN],
];

export function addHealth(h: Health) {
  app.health = h;
  if (h.time > (app.live.times.at(-1) ?? -Infinity)) {
    const row: Record<string, number> = { time: h.time };
    const units: Record<string, string> = { time: "s" };
    for (const [name, unit, of] of kColumns) {
      row[name] = of(h);
      if (unit) units[name] = unit;
    }
    app.live.addRow(row, units);
    app.changedRows = true;
  }
  showHealth();
}

export function showHealth() {
  const h = app.health;
  table.hidden = !h;
  if (h) rows.forEach(([, text], i) => (cells[i].textContent = text(h)));
  table.dataset.state = h && h.state !== "running" ? "bad" : "";
  views[0].hand = h && app.device && app.engine === "running" ? h : null;
  views[0].draw();
}

/** After the scene has changed: whether it has a handle. */
export function offerHand() {
  const has = !!app.scene?.haptic?.handle;
  start.disabled = !has;
  startHint.textContent = has ? "" : "The scene has no \"haptic\": no body is in the hand.";
}

export function hapticPanel(): HTMLElement {
  return el(
    "div",
    {},
    labelled(
      "Device",
      select(
        "Device",
        [
          ["simulated", "simulated hand"],
          ["spacemouse", "3D mouse"],
          ["udp", "UDP"],
        ],
        device,
        (v) => {
          device = v;
          restRow.hidden = v !== "udp";
        },
      ),
    ),
    restRow,
    labelled("Without real time", el("input", { type: "checkbox", "aria-label": "Without real time", onchange: (e: Event) => (virtual = (e.target as HTMLInputElement).checked) })),
    el("div", { class: "hold" }, start),
    startHint,
    table,
  );
}
