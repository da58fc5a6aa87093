// Requests to the server, with the token of the address's fragment (docs/studio.md).

const token = location.hash.slice(1);
const headers = { Authorization: "Bearer " + token };

export interface Issue {
  file: string;
  place: string;
  found: string;
  allowed: string;
}

export interface Answer {
  ok: boolean;
  issues?: Issue[];
  [name: string]: any;
}

export interface EngineState {
  state: "none" | "starting" | "paused" | "running" | "failed" | "stopped";
  reason: string;
  scene: string;
  saved_time: number | null;
}

let last = 0;

export async function command(what: string, fields: object = {}): Promise<Answer> {
  try {
    const answer = await fetch("/api/command", {
      method: "POST",
      headers,
      body: JSON.stringify({ id: ++last, do: what, ...fields }),
    });
    if (!answer.ok) throw new Error(`${answer.status} ${await answer.text()}`);
    return await answer.json();
  } catch (error) {
    const found = String((error as Error).message);
    return { ok: false, issues: [{ file: "", place: "", found, allowed: "a server that runs" }] };
  }
}

export async function get(path: string): Promise<any> {
  const answer = await fetch(path, { headers });
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

export async function file(path: string): Promise<ArrayBuffer> {
  const answer = await fetch("/api/file?path=" + encodeURIComponent(path), { headers });
  if (!answer.ok) throw new Error(`${path}: ${answer.status} ${await answer.text()}`);
  return answer.arrayBuffer();
}

export async function fileText(path: string): Promise<string> {
  return new TextDecoder().decode(await file(path));
}

/** The newest frame after one; null if there is none for two seconds. 0: a whole one. */
export async function frame(after: number): Promise<ArrayBuffer | null> {
  const answer = await fetch("/api/frame?after=" + after, { headers });
  return answer.status === 200 ? answer.arrayBuffer() : null;
}

/** Calls `take` for each event until the server ends, then `lost`. */
export async function events(from: number, take: (event: any) => void, lost: () => void) {
  try {
    const answer = await fetch("/api/events?from=" + from, { headers });
    const reader = answer.body!.getReader();
    const decoder = new TextDecoder();
    let text = "";
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      text += decoder.decode(value, { stream: true });
      let end: number;
      while ((end = text.indexOf("\n")) >= 0) {
        take(JSON.parse(text.slice(0, end)));
        text = text.slice(end + 1);
      }
    }
  } catch {
    // reported below
  }
  lost();
}

export function issueText(issues: Issue[] | undefined): string {
  return (issues ?? [])
    .map((i) => (i.place ? i.place + ": " : "") + `found ${i.found}, allowed: ${i.allowed}`)
    .join("; ");
}
