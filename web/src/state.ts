// State of the page, shared by its parts. Whatever changes it calls the functions that show it.

import type { EngineState } from "./api";
import { exported } from "./export";
import { LiveReader, type Instant } from "./frames";
import { Run } from "./runs";
import type { Appearance } from "./appearance";

export interface Health {
  time: number;
  rate: number;
  rate_aim: number;
  ticks: number;
  missed: number;
  missed_by_work: number;
  p99: number; // [s]
  late_p99: number; // [s]
  energy: number; // [J]
  state: string;
  reason: string;
  step_rate?: number;
  step_rate_aim: number;
  contacts: number;
  refused_steps: number;
  force: number[]; // [N]
  torque: number[]; // [N m]
  device: number[]; // [m]
  handle: number[]; // [m]
}

export const newAppearance = (): Appearance => ({
  mode: "normal",
  bodies: new Map(),
  field: "",
  arrows: { shown: true, part: "force", other: false, within: 0 },
  range: null,
  cut: { axis: "", share: 0.5, flip: false },
});

export const offline = exported();

export const app = {
  root: "",
  schema: {} as any,
  scene: null as any, // with every default
  start: { scene: "", set: [] as string[] },
  engine: "none" as EngineState["state"] | "ended",
  device: "", // of a haptic run
  folder: "", // of results that the engine writes, below the root
  live: new Run("live"),
  shown: null as unknown as Run, // what timeline and views show
  other: null as Run | null, // compared with it
  two: false, // two views of one run
  kept: [] as Run[],
  cursor: -1, // of shown.moments
  following: true,
  instant: null as Instant | null, // shown
  health: null as Health | null,
  changedRows: true,
  ended: false, // the server
  frames: new LiveReader(),
};
app.shown = app.live;

/** Below the root, in the form of the server's interface. */
export function belowRoot(path: string): string {
  return path.startsWith(app.root + "/") ? path.slice(app.root.length + 1) : path;
}
