// Short ids of runs: the shortest unique prefixes, as in the table of runs.

import { call, refused } from "./api.js";

const LENGTH = 22;
const LAST = "z".repeat(LENGTH);

// Returns the complete id for a prefix. If the prefix is unknown or ambiguous it is returned unchanged, and the server
// reports the problem.
async function whole(name, list) {
  if (name.length >= LENGTH || !/^[0-9a-z]+$/.test(name)) return name;
  const found = await list(name);
  return found.length === 1 ? found[0].id : name;
}

const runs = async (name) => (await call(`v1/runs?limit=2&prefix=${name}`)).runs;
const sweeps = async (name) => (await call(`v1/sweeps?limit=2&before=${name}${LAST}`)).sweeps.filter(({ id }) => id.startsWith(name));

// Returns the complete ids for the names in an address; names are unchanged after a refusal by the server. Throws Error
// if the server does not answer.
export async function wholeNames(page, names) {
  try {
    return await Promise.all(names.map((name) => whole(name, page === "sweep" ? sweeps : runs)));
  } catch (error) {
    if (!refused(error)) throw error;
    return names;
  }
}

export const isShort = (name) => name.length < LENGTH;
