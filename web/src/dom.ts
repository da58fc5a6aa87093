// Elements in one call: el("button", { onclick }, "Run").

type Child = Node | string | null | undefined;

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, any> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const e = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) e.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "disabled") (e as any)[name] = value;
    else e.setAttribute(name, value === true ? "" : String(value));
  }
  for (const c of children) if (c != null) e.append(c);
  return e;
}

let lastId = 0;

/** A control with its label before it. */
export function labelled(text: string, control: HTMLElement, ...after: Child[]): HTMLElement {
  control.id ||= "c" + ++lastId;
  return el("div", { class: "row" }, el("label", { for: control.id }, text), control, ...after);
}

export function select(
  label: string,
  options: [value: string, text: string][],
  value: string,
  change: (value: string) => void,
): HTMLSelectElement {
  const s = el("select", { "aria-label": label, onchange: () => change(s.value) });
  for (const [v, text] of options) s.append(el("option", { value: v }, text));
  s.value = value;
  return s;
}

export function save(name: string, content: Blob) {
  const url = URL.createObjectURL(content);
  el("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
