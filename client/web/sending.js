// Upload of a file, in the same way as the command line (docs/meshes.md): in pieces, from the first missing byte on,
// so that a broken connection costs one piece.

import { Problem, call } from "./api.js";

const LARGEST = 1 << 20; // Bytes of a piece: a proxy takes bodies of 1 MiB.
const PAUSE = 500; // ms after a break before the server is asked for its number of bytes.
const PATIENCE = 60000; // ms without progress after which the upload is given up.
const PASSING = new Set(["wrong_offset", "in_progress", "incomplete", "busy"]);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// { offset, whole } of a file by its sha256; 0 and false for an unknown one. The file is searched in the list of the
// user's files: a browser logs an answer of 404 as an error of the page.
export async function there(sha256, signal) {
  const { files } = await call("v1/files", { signal });
  return files.find((file) => file.sha256 === sha256) ?? { offset: 0, whole: false };
}

// On return the server has the file; `onBytes` is called with the number of sent bytes. Throws Problem, Error.
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

// True if the same piece may be sent later: another client sends the file now, or the server does not answer.
const passes = (error) => !(error instanceof Problem) || error.status >= 500 || error.status === 408 || PASSING.has(error.body?.code);
