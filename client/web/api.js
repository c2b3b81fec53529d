// The server's REST and SSE, with the token of this tab. EventSource cannot send headers, so SSE is read with fetch.

const KEY = "conoid.token";

export const token = {
  get: () => sessionStorage.getItem(KEY) ?? "",
  set: (text) => sessionStorage.setItem(KEY, text),
  clear: () => sessionStorage.removeItem(KEY),
};

// A refusal in the server's own words (RFC 9457).
export class Problem extends Error {
  constructor(status, body) {
    const detail = body?.detail && body.detail !== body.title ? `: ${body.detail}` : "";
    super(`${body?.title ?? `the server answered ${status}`}${detail}`);
    this.status = status;
  }
}

// Whether the server will not answer later either; a proxy says 502 and 503 for a server that starts again.
export const refused = (error) => error instanceof Problem && error.status < 500 && error.status !== 429;

const address = (path) => new URL(path, document.baseURI);

async function send(path, { method = "GET", headers = {}, signal, cache = "no-store" } = {}) {
  const shown = token.get() ? { Authorization: `Bearer ${token.get()}` } : {};
  const response = await fetch(address(path), { method, headers: { ...shown, ...headers }, signal, cache });
  if (!response.ok) throw new Problem(response.status, await response.json().catch(() => null));
  return response;
}

// Snapshots never change, and the server says so: the browser keeps them.
export const binary = async (path, options) => (await send(path, { ...options, cache: "default" })).arrayBuffer();

const TAIL = 65536; // Bytes of a log that are shown.

// The end of the log of a rank, or of "launcher". Of an empty file no part can be asked for.
export async function tail(run, rank) {
  const path = `v1/runs/${encodeURIComponent(run)}/logs/${rank}`;
  const { headers } = await send(path, { method: "HEAD" });
  if (headers.get("Content-Length") === "0") return "";
  return (await send(path, { headers: { Range: `bytes=-${TAIL}` } })).text();
}

export const call = async (path, options) => (await send(path, options)).json();

// The messages of a run after the number `after`, as they come, until the server ends the stream.
export async function* messages(run, after, signal) {
  const headers = { Accept: "text/event-stream", "Last-Event-ID": String(after) };
  const response = await send(`v1/runs/${encodeURIComponent(run)}/stream`, { headers, signal });
  if (response.status === 204) return;
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let buffer = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    buffer += value.replaceAll("\r", "");
    const blocks = buffer.split("\n\n");
    buffer = blocks.pop();
    for (const block of blocks) {
      const data = block.split("\n").filter((line) => line.startsWith("data:")).map((line) => line.slice(5).trimStart());
      if (data.length) yield JSON.parse(data.join("\n"));
    }
  }
}
