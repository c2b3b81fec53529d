// Upload of a file, in the same way as by the command line (docs/meshes.md). Pieces are sent from the first missing
// byte on, so that a broken connection loses at most one piece.

import { Problem, call } from "./api.js";

const LARGEST = 1 << 20; // Size of a piece, bytes; a proxy accepts requests of 1 MiB.
const PAUSE = 500; // Pause in ms after a broken connection before the page asks the server how many bytes have arrived.
const PATIENCE = 60000; // Time in ms without progress after which the upload is given up.
const PASSING = new Set(["wrong_offset", "in_progress", "incomplete", "busy"]);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// Returns { offset, whole } of a file by its sha256; 0 and false for an unknown file. The page searches the list of the
// user's files, because a browser logs an answer 404 as an error of the page.
export async function there(sha256, signal) {
  const { files } = await call("v1/files", { signal });
  return files.find((file) => file.sha256 === sha256) ?? { offset: 0, whole: false };
}

// Sends a file; on return the server has the file. `onBytes` is called with the number of sent bytes. Throws Problem,
// Error.
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

// Returns true if the same piece may be sent later: another client is sending the file, or the server does not answer.
const passes = (error) => !(error instanceof Problem) || error.status >= 500 || error.status === 408 || PASSING.has(error.body?.code);
