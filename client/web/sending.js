// A file on its way to the server, as the command line sends it (docs/meshes.md): in pieces, from the byte on that is
// missing, so that a broken connection costs one piece.

import { Problem, call } from "./api.js";

const LARGEST = 1 << 20; // Bytes of a piece: a proxy takes bodies of 1 MiB.
const PAUSE = 500; // ms after a break before the server is asked how much it has.
const PATIENCE = 60000; // ms without a byte after which the sending is given up.
const PASSING = new Set(["wrong_offset", "in_progress", "incomplete", "busy"]);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// { offset, whole } of a file by its sha256; of one that the server has nothing of 0 and false. It is looked up in the
// list of the user's files: a browser calls an answer of 404 an error of the page.
export async function there(sha256, signal) {
  const { files } = await call("v1/files", { signal });
  return files.find((file) => file.sha256 === sha256) ?? { offset: 0, whole: false };
}

// The server has the file when this returns; `onBytes` hears how much of it. Throws Problem, Error.
export async function sendFile(file, sha256, onBytes, signal) {
  let { offset, whole } = await there(sha256, signal);
  let moved = Date.now();
  while (!whole) {
    onBytes(offset);
    const before = offset;
    try {
      ({ offset, whole } = await piece(file, sha256, offset, signal));
    } catch (error) {
      if (signal?.aborted || !passes(error) || Date.now() - moved > PATIENCE) throw error;
      await pause(PAUSE);
      ({ offset, whole } = await there(sha256, signal).catch(() => ({ offset, whole })));
    }
    if (offset > before) moved = Date.now();
  }
  onBytes(file.size);
}

function piece(file, sha256, offset, signal) {
  const body = file.slice(offset, offset + LARGEST);
  const span = body.size ? `${offset}-${offset + body.size - 1}` : "*";
  const headers = { "Content-Type": "application/octet-stream", ...(file.size ? { "Content-Range": `bytes ${span}/${file.size}` } : {}) };
  return call(`v1/files/${sha256}`, { method: "PUT", headers, body, signal });
}

// Whether the same piece may be taken later: another one sends the file just now, or nobody answers.
const passes = (error) => !(error instanceof Problem) || error.status >= 500 || error.status === 408 || PASSING.has(error.body?.code);
