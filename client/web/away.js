// Time since which the server does not answer, and the texts about it.

import { clock } from "./figures.js";

let since = null;

// A request without an answer.
export class Unanswered extends Error {
  constructor() {
    since ??= Date.now();
    super(`the server has not answered since ${clock(since / 1000)}`);
  }
}

export const answered = () => { since = null; };

// Returns the text of a page whose request failed. `left` states what the user can still do; `ms` is the time after which
// the request is repeated, or 0.
export function unanswered(error, left = "", ms = 0) {
  const what = error instanceof Unanswered ? `${error.message[0].toUpperCase()}${error.message.slice(1)}` : `No answer from the server: ${error.message}`;
  return [`${what}.`, left, ms ? `The request is repeated every ${Math.round(ms / 1000)} s.` : ""].filter(Boolean).join(" ");
}
