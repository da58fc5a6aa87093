// Curves of any column over time, with a cursor that is the timeline's; two runs and their difference.

import uPlot from "uplot";
import type { Run } from "./runs";
import { el, select } from "./dom";
import { shortNumber } from "./colours";

const kColours = ["#1f4e9c", "#c1440e", "#2f7d4f"];

export class Plot {
  readonly element: HTMLElement;
  column = "";
  private plot: uPlot | null = null;
  private readonly chooser: HTMLSelectElement;
  private readonly value = el("output", { class: "value" });
  private readonly body = el("div", { class: "curve" });
  private runs: Run[] = [];
  private difference = false;
  private time = 0;
  private key = "";
  private names = "";
  private readonly cursor = el("div", { class: "cursor", "aria-hidden": "true", hidden: true });

  constructor(
    label: string,
    private readonly seek: (time: number) => void,
  ) {
    this.chooser = select(label, [], "", (v) => {
      this.column = v;
      this.redraw(true);
    });
    this.element = el(
      "section",
      { class: "plot", "aria-label": label },
      el("div", { class: "plothead" }, this.chooser, this.value),
      this.body,
    );
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(this.body);
  }

  private size() {
    return { width: Math.max(120, this.body.clientWidth), height: Math.max(70, this.body.clientHeight) };
  }

  show(runs: Run[], preferred: string[], difference: boolean) {
    this.runs = runs;
    this.difference = difference;
    const columns = new Set<string>();
    for (const r of runs) for (const c of r.columns.keys()) if (c !== "time") columns.add(c);
    const names = [...columns].join();
    if (names !== this.names) {
      this.names = names;
      this.chooser.replaceChildren(...[...columns].map((c) => el("option", { value: c }, c.replaceAll("_", " "))));
      if (!columns.has(this.column)) this.column = preferred.find((w) => columns.has(w)) ?? [...columns][0] ?? "";
      this.chooser.value = this.column;
    }
    this.redraw(false);
  }

  private data(): uPlot.AlignedData {
    // Times of two runs that differ by round-off are one.
    const times: number[] = [];
    for (const t of this.runs.flatMap((r) => r.times).sort((a, b) => a - b))
      if (times.length === 0 || t - times[times.length - 1] > 1e-9 * Math.abs(t)) times.push(t);
    const curves = this.runs.map((r) => {
      if (this.runs.length === 1 && r.times.length === times.length) return r.columns.get(this.column) ?? times.map(() => null);
      return times.map((t) => {
        const v = r.valueAt(this.column, t);
        return Number.isFinite(v) ? v : null;
      });
    });
    if (this.difference && curves.length === 2)
      curves.push(
        times.map((_, i) => {
          const a = curves[0][i];
          const b = curves[1][i];
          return a == null || b == null || !Number.isFinite(a) || !Number.isFinite(b) ? null : a - b;
        }),
      );
    return [times, ...curves] as uPlot.AlignedData;
  }

  private get unit(): string {
    return this.runs.map((r) => r.units.get(this.column)).find((u) => u) ?? "";
  }

  private redraw(again: boolean) {
    const key = this.column + this.runs.map((r) => r.name).join() + this.difference + this.unit;
    if (again || key !== this.key || !this.plot) {
      this.key = key;
      this.plot?.destroy();
      const series: uPlot.Series[] = [{}];
      const names = this.runs.map((r) => r.name);
      if (this.difference && names.length === 2) names.push("difference");
      names.forEach((label, i) => series.push({ label, stroke: kColours[i], width: 1.6, pxAlign: 0, dash: i === 1 ? [6, 4] : undefined, points: { show: false } }));
      const axis = { stroke: "#333", grid: { stroke: "#e6e8eb", width: 1 }, ticks: { stroke: "#ccc", width: 1 }, font: "11px system-ui, sans-serif", labelFont: "11px system-ui, sans-serif" };
      this.plot = new uPlot(
        {
          ...this.size(),
          legend: { show: false },
          cursor: { y: false, drag: { x: false, y: false } },
          scales: { x: { time: false } },
          axes: [
            { ...axis, label: "time [s]", labelSize: 16, size: 28 },
            { ...axis, label: this.unit ? `[${this.unit}]` : undefined, labelSize: 16, size: 58, values: (_, v) => v.map((x) => shortNumber(x)) },
          ],
          series,
          hooks: {
            draw: [(u) => this.placeCursor(u)],
            ready: [
              (u) => {
                u.over.append(this.cursor);
                u.over.addEventListener("click", () => this.seek(u.posToVal(u.cursor.left ?? 0, "x")));
              },
            ],
          },
        },
        this.data(),
        this.body,
      );
    } else {
      this.plot.setData(this.data());
    }
    this.showValue();
  }

  setTime(time: number) {
    this.time = time;
    if (this.plot) this.placeCursor(this.plot);
    this.showValue();
  }

  private showValue() {
    const v = this.runs.map((r) => r.valueAt(this.column, this.time));
    const parts = v.map((x, i) => (this.runs.length > 1 ? this.runs[i].name + " " : "") + (Number.isFinite(x) ? shortNumber(x) : "–"));
    if (this.runs.length === 2 && v.every(Number.isFinite)) parts.push("difference " + shortNumber(v[0] - v[1]));
    this.value.textContent = parts.join("; ") + (this.unit ? " " + this.unit : "");
  }

  /** A line above the curves: to move it costs no drawing of them. */
  private placeCursor(u: uPlot) {
    const x = u.valToPos(this.time, "x");
    this.cursor.hidden = !(x >= -1 && x <= u.over.clientWidth + 1);
    if (!this.cursor.hidden) this.cursor.style.transform = `translateX(${x}px)`;
  }

  /** The curves as a picture of lines. */
  svg(): string {
    const [times, ...curves] = this.data() as unknown as (number | null)[][];
    const w = 640;
    const h = 400;
    const left = 80;
    const right = 20;
    const top = 20;
    const bottom = 50;
    const all = curves.flat().filter((v): v is number => v != null && Number.isFinite(v));
    let low = Math.min(...all);
    let high = Math.max(...all);
    if (!(high > low)) {
      low -= 0.5 * Math.abs(low) || 0.5;
      high += 0.5 * Math.abs(high) || 0.5;
    }
    const t0 = Number(times[0] ?? 0);
    const t1 = Number(times[times.length - 1] ?? 1);
    const x = (t: number) => left + ((t - t0) / (t1 - t0 || 1)) * (w - left - right);
    const y = (v: number) => h - bottom - ((v - low) / (high - low)) * (h - top - bottom);
    const escape = (s: string) => s.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
    const out = [
      `<svg xmlns="http://www.w3.org/2000/svg" width="${w}" height="${h}" viewBox="0 0 ${w} ${h}" font-family="sans-serif" font-size="12">`,
      `<rect width="${w}" height="${h}" fill="white"/>`,
      `<path d="M${left} ${top}V${h - bottom}H${w - right}" fill="none" stroke="black"/>`,
    ];
    for (let i = 0; i <= 4; ++i) {
      const t = t0 + ((t1 - t0) * i) / 4;
      const v = low + ((high - low) * i) / 4;
      out.push(`<text x="${x(t)}" y="${h - bottom + 18}" text-anchor="middle">${shortNumber(t)}</text>`);
      out.push(`<text x="${left - 8}" y="${y(v) + 4}" text-anchor="end">${shortNumber(v)}</text>`);
    }
    const unit = this.unit ? ` [${this.unit}]` : "";
    out.push(`<text x="${(left + w - right) / 2}" y="${h - 12}" text-anchor="middle">time [s]</text>`);
    out.push(`<text transform="translate(16 ${(top + h - bottom) / 2}) rotate(-90)" text-anchor="middle">${escape(this.column.replaceAll("_", " ") + unit)}</text>`);
    curves.forEach((c, k) => {
      let path = "";
      let pen = false;
      c.forEach((v, i) => {
        if (v == null || !Number.isFinite(v)) return void (pen = false);
        path += `${pen ? "L" : "M"}${x(Number(times[i])).toFixed(2)} ${y(v).toFixed(2)}`;
        pen = true;
      });
      out.push(`<path d="${path}" fill="none" stroke="${kColours[k]}" stroke-width="1.5"${k === 1 ? ' stroke-dasharray="6 4"' : ""}/>`);
      if (curves.length > 1)
        out.push(`<text x="${w - right}" y="${top + 14 * (k + 1)}" text-anchor="end" fill="${kColours[k]}">${escape(this.runs[k]?.name ?? "difference")}</text>`);
    });
    return out.join("\n") + "\n</svg>\n";
  }
}
