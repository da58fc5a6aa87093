// Every field of the scene, by the schema that `amontons schema` prints: type, unit, range and words.

import { el, labelled } from "./dom";

export type Schema = any;

function fits(schema: Schema, value: any): boolean {
  if ("const" in schema) return schema.const === value;
  if (schema.enum) return schema.enum.includes(value);
  if (schema.oneOf) return schema.oneOf.some((s: Schema) => fits(s, value));
  switch (schema.type) {
    case "object": {
      if (typeof value !== "object" || value === null || Array.isArray(value)) return false;
      for (const name of schema.required ?? []) if (!(name in value)) return false;
      for (const [name, v] of Object.entries(value)) {
        const s = schema.properties?.[name];
        if (s ? !fits(s, v) : schema.additionalProperties === false && !schema.patternProperties) return false;
      }
      return true;
    }
    case "array":
      return Array.isArray(value);
    case "number":
    case "integer":
      return typeof value === "number";
    case "string":
      return typeof value === "string";
    case "boolean":
      return typeof value === "boolean";
  }
  return true;
}

/** The branch of a schema that a value is of. */
export function branchOf(schema: Schema, value: any): Schema {
  if (!schema?.oneOf) return schema ?? {};
  const known = schema.oneOf.find((s: Schema) => fits(s, value));
  if (known) return branchOf(known, value);
  // A resolved scene may have more than one that writes: the kind decides.
  const kind = schema.oneOf.find((s: Schema) =>
    Object.entries(s.properties ?? {}).some(([n, p]: [string, any]) => "const" in p && value?.[n] === p.const),
  );
  return kind ?? schema.oneOf.find((s: Schema) => s.type === "object" && typeof value === "object") ?? {};
}

export function childSchema(schema: Schema, name: string): Schema {
  if (schema.properties?.[name]) return schema.properties[name];
  for (const s of Object.values(schema.patternProperties ?? {})) return s;
  if (schema.items && !Array.isArray(schema.items)) return schema.items;
  return {};
}

/** "Young's modulus E. [Pa]" in words and unit. */
export function words(description = ""): { text: string; unit: string } {
  const match = /^(.*?)\s*\[([^\]]+)\](.*)$/s.exec(description);
  return match ? { text: (match[1] + match[3]).trim(), unit: match[2] } : { text: description, unit: "" };
}

function rangeText(s: Schema): string {
  const parts: string[] = [];
  if (s.minimum !== undefined) parts.push(">= " + s.minimum);
  if (s.exclusiveMinimum !== undefined) parts.push("> " + s.exclusiveMinimum);
  if (s.maximum !== undefined) parts.push("<= " + s.maximum);
  if (s.exclusiveMaximum !== undefined) parts.push("< " + s.exclusiveMaximum);
  return parts.join(" and ");
}

// What people change first stands open.
const kOpen = new Set(["", "bodies", "contact", "time"]);
const kTooLong = 400; // characters of a value that is shown as text

/**
 * A tree of all fields. `change` gets the path (with dots) and the value.
 * @param filter  only fields whose path holds it
 */
export function editor(
  scene: any,
  schema: Schema,
  filter: string,
  change: (path: string, value: any, old: any) => void,
): HTMLElement {
  const root = el("div", { class: "fields" });
  const pattern = filter.trim().toLowerCase();
  const add = (parent: HTMLElement, value: any, s: Schema, path: string[]): boolean => {
    const branch = branchOf(s, value);
    let any = false;
    for (const [name, v] of Object.entries(value)) {
      const sub = childSchema(branch, name);
      const own = branchOf(sub, v);
      const place = [...path, name];
      if ("const" in own || name === "$schema" || (path.length === 0 && name === "schema")) continue;
      const deep =
        typeof v === "object" && v !== null && !(Array.isArray(v) && (v as any[]).every((x) => typeof x !== "object" || Array.isArray(x)));
      if (deep) {
        const inside = el("div", { class: "inside" });
        const title = Array.isArray(value) && (v as any).between ? (v as any).between.join(" and ") : name;
        const open = pattern !== "" || kOpen.has(path.join(".")) || kOpen.has(name) || (path[0] === "contact" && path.length === 1);
        if (!add(inside, v, sub, place)) continue;
        parent.append(el("details", { open }, el("summary", {}, title), inside));
        any = true;
      } else if (!pattern || place.join(".").toLowerCase().includes(pattern)) {
        parent.append(field(place, v, own, sub, change));
        any = true;
      }
    }
    return any;
  };
  add(root, scene, schema, []);
  return root;
}

function field(
  path: string[],
  value: any,
  branch: Schema,
  schema: Schema,
  change: (path: string, value: any, old: any) => void,
): HTMLElement {
  const name = path.join(".");
  const { text, unit } = words(branch.description ?? schema.description);
  const hint = [text, rangeText(branch), schema.default !== undefined ? "default " + JSON.stringify(schema.default) : ""]
    .filter((x) => x)
    .join(" · ");
  const label = path[path.length - 1].replaceAll("_", " ");
  let control: HTMLInputElement | HTMLSelectElement;
  const send = (v: any) => change(name, v, value);
  if (typeof value === "boolean") {
    control = el("input", { type: "checkbox", checked: value, onchange: () => send((control as HTMLInputElement).checked) });
  } else if (branch.enum) {
    control = el("select", { onchange: () => send((control as HTMLSelectElement).value) });
    for (const o of branch.enum) control.append(el("option", { value: o }, o));
    control.value = value;
  } else {
    const json = typeof value !== "number" && typeof value !== "string";
    const shown = json ? JSON.stringify(value) : String(value);
    if (shown.length > kTooLong)
      return el("div", { class: "row" }, el("span", {}, label), el("span", { class: "unit" }, `${shown.length} characters`));
    control = el("input", {
      type: "text",
      value: shown,
      inputmode: typeof value === "number" ? "decimal" : undefined,
      onchange: () => {
        const typed = (control as HTMLInputElement).value;
        if (typeof value === "string") return send(typed);
        try {
          send(JSON.parse(typed));
        } catch {
          send(typed); // refused with the reader's own words
        }
      },
    });
  }
  control.title = hint;
  control.setAttribute("aria-label", name);
  control.dataset.path = name;
  return labelled(label, control, unit ? el("span", { class: "unit" }, unit) : null);
}

/** With a value at a path; the rest is shared. */
export function valueAt(scene: any, path: string): any {
  return path.split(".").reduce((v, name) => v?.[name], scene);
}
