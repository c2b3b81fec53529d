// Requests to the server over REST and SSE, with the token of this tab. EventSource cannot send headers, so SSE is read
// with fetch.

import { Unanswered, answered } from "./away.js";
import { token } from "./token.js";

export { token };

// A refusal by the server with the server's message (RFC 9457).
export class Problem extends Error {
  constructor(status, body) {
    const detail = body?.detail && body.detail !== body.title ? `: ${body.detail}` : "";
    super(`${body?.title ?? `the server answered ${status}`}${detail}`);
    Object.assign(this, { status, body });
  }
}

// True if a repeated request would be refused as well. A proxy answers 502 and 503 while the server restarts.
export const refused = (error) => error instanceof Problem && error.status < 500 && error.status !== 429;

const address = (path) => new URL(path, document.baseURI);

export async function send(path, { method = "GET", headers = {}, body, signal, cache = "no-store" } = {}) {
  const shown = token.get() ? { Authorization: `Bearer ${token.get()}` } : {};
  const response = await fetch(address(path), { method, headers: { ...shown, ...headers }, body, signal, cache }).catch((error) => {
    throw signal?.aborted ? error : new Unanswered();
  });
  answered();
  if (!response.ok) throw new Problem(response.status, await response.json().catch(() => null));
  return response;
}

// Snapshots never change, so the server's cache headers let the browser keep them.
export const binary = async (path, options) => (await send(path, { ...options, cache: "default" })).arrayBuffer();

export const text = async (path, options) => (await send(path, options)).text();

const TAIL = 65536; // Number of bytes from the end of a log that are shown.

// Fetches the end of the log of a rank, or of "launcher". A request with Range would fail for an empty file.
export async function tail(run, rank) {
  const path = `v1/runs/${encodeURIComponent(run)}/logs/${rank}`;
  const { headers } = await send(path, { method: "HEAD" });
  if (headers.get("Content-Length") === "0") return "";
  return (await send(path, { headers: { Range: `bytes=-${TAIL}` } })).text();
}

export const call = async (path, options) => (await send(path, options)).json();

const LARGE = 64 << 20; // File size in bytes from which a file is streamed to disk, if the browser supports streaming.
const MOST = 1 << 30; // Largest size in bytes of a file that the browser keeps in memory before the file is saved.

// Saves a file of the server as `name`. A link cannot send the token, so the page fetches the bytes. `onBytes` is
// called with the number of bytes fetched so far. Throws Error if the file is too large for memory.
export async function download(path, name, size, onBytes) {
  const place = size > LARGE ? await globalThis.showSaveFilePicker?.({ suggestedName: name }) : null;
  if (!place && size > MOST) throw new Error("the file is too large for this browser; conoid get copies it");
  const { body } = await send(path);
  let there = 0;
  const counted = body.pipeThrough(new TransformStream({ transform(chunk, out) {
    onBytes(there += chunk.byteLength);
    out.enqueue(chunk);
  } }));
  if (place) return counted.pipeTo(await place.createWritable());
  const href = URL.createObjectURL(await new Response(counted).blob());
  Object.assign(document.createElement("a"), { href, download: name }).click();
  return setTimeout(() => URL.revokeObjectURL(href), 60000);
}

// Yields the messages of a run after the number `after` as they arrive, until the server ends the stream. `onOpen` is
// called when the stream begins.
export async function* messages(run, after, signal, onOpen) {
  const headers = { Accept: "text/event-stream", "Last-Event-ID": String(after) };
  const response = await send(`v1/runs/${encodeURIComponent(run)}/stream`, { headers, signal });
  if (response.status === 204) return;
  onOpen();
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
