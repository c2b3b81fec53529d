// Short ids: the shortest unique prefix, as in the table.

import { call, refused } from "./api.js";

const LENGTH = 22;
const LAST = "z".repeat(LENGTH);

// Whole id of a prefix; the prefix itself if it is unknown or ambiguous: the server reports the problem.
async function whole(name, list) {
  if (name.length >= LENGTH || !/^[0-9a-z]+$/.test(name)) return name;
  const found = await list(name);
  return found.length === 1 ? found[0].id : name;
}

const runs = async (name) => (await call(`v1/runs?limit=2&prefix=${name}`)).runs;
const sweeps = async (name) => (await call(`v1/sweeps?limit=2&before=${name}${LAST}`)).sweeps.filter(({ id }) => id.startsWith(name));

// Whole ids of the names of a page; unchanged after a refusal. Throws Error without an answer.
export async function wholeNames(page, names) {
  try {
    return await Promise.all(names.map((name) => whole(name, page === "sweep" ? sweeps : runs)));
  } catch (error) {
    if (!refused(error)) throw error;
    return names;
  }
}

export const isShort = (name) => name.length < LENGTH;
