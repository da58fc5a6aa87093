// Appearance of a view.

export type Mode = "normal" | "wire" | "transparent" | "xray";

export const kModes: [Mode, string][] = [
  ["normal", "Normal"],
  ["wire", "Wire"],
  ["transparent", "Transparent"],
  ["xray", "X-ray"],
];

export interface BodyAppearance {
  shown: boolean;
  mode: Mode | "";
}

export interface Arrows {
  shown: boolean;
  part: "force" | "normal" | "friction";
  other: boolean; // on the body that the caption does not name, with the other sign
  within: number; // contacts of a pair that are nearer are one arrow [m]
}

export interface Cut {
  axis: "" | "x" | "y" | "z";
  share: number; // of the way through the box of what is seen
  flip: boolean;
}

export interface Appearance {
  mode: Mode;
  bodies: Map<string, BodyAppearance>;
  field: string; // "" for plain
  arrows: Arrows;
  range: [number, number] | null; // of the field; null: of what is seen
  cut: Cut;
}
