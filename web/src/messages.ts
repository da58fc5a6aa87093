// Messages of the page, the newest first.

import * as api from "./api";
import { el } from "./dom";

const kMost = 100;
const list = el("ul");
export const log = el("div", { class: "messages", "aria-label": "Messages", role: "log", tabindex: 0 }, list);

export function showMessage(text: string, bad = false, ...more: HTMLElement[]) {
  if (!text) return;
  if (more.length === 0 && list.firstElementChild?.textContent === text) return;
  list.prepend(el("li", { class: bad ? "bad" : "" }, text, ...more));
  while (list.children.length > kMost) list.lastElementChild!.remove();
}

/** A command whose refusal is shown. */
export async function request(what: string, fields: object = {}): Promise<api.Answer> {
  const answer = await api.command(what, fields);
  if (!answer.ok) showMessage(`${what}: ${api.issueText(answer.issues)}`, true);
  return answer;
}
