// Colours of fields: viridis (S. van der Walt and N. Smith, 2015), which is even to the eye, readable
// without red and green, and in grey. Eleven stops of it, linear between them.

const kStops = [
  0x440154, 0x482475, 0x414487, 0x355f8d, 0x2a788e, 0x21918c, 0x22a884, 0x44bf70, 0x7ad151, 0xbddf26, 0xfde725,
].map((c) => [(c >> 16) / 255, ((c >> 8) & 255) / 255, (c & 255) / 255]);

/** @param x 0 to 1; outside of it the colour of the end  @return red, green, blue, 0 to 1 */
export function viridis(x: number): [number, number, number] {
  const t = Math.min(1, Math.max(0, x)) * (kStops.length - 1);
  const i = Math.min(kStops.length - 2, Math.floor(t));
  const f = t - i;
  return [0, 1, 2].map((k) => kStops[i][k] * (1 - f) + kStops[i + 1][k] * f) as [number, number, number];
}

export const kPlain = [
  [0.72, 0.75, 0.78],
  [0.86, 0.78, 0.66],
  [0.7, 0.8, 0.74],
  [0.78, 0.72, 0.82],
] as [number, number, number][];

/** Three or four digits, with a power of ten where it has to be. */
export function shortNumber(x: number): string {
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e5 || size < 1e-3) return x.toExponential(2).replace("e+", "e");
  return String(Number(x.toPrecision(4)));
}

/** A round number at or below x: 1, 2 or 5 times a power of ten. */
export function roundBelow(x: number): number {
  const power = 10 ** Math.floor(Math.log10(x));
  return power * (x / power >= 5 ? 5 : x / power >= 2 ? 2 : 1);
}

/** A length with the unit that people use for its size. */
export function lengthText(metres: number): string {
  for (const [unit, size] of [["m", 1], ["mm", 1e-3], ["µm", 1e-6], ["nm", 1e-9]] as [string, number][])
    if (metres >= size) return Number((metres / size).toPrecision(3)) + " " + unit;
  return metres + " m";
}
