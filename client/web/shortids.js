// Ids that are written short: the shortest beginning that no other one has, as the table shows them.

import { call, refused } from "./api.js";

const LENGTH = 22;
const LAST = "z".repeat(LENGTH);

// The whole id that is meant by a name; the name itself where none, or more than one, begins so: the server says why.
async function whole(name, list) {
  if (name.length >= LENGTH || !/^[0-9a-z]+$/.test(name)) return name;
  const found = await list(name);
  return found.length === 1 ? found[0].id : name;
}

const runs = async (name) => (await call(`v1/runs?limit=2&prefix=${name}`)).runs;
const sweeps = async (name) => (await call(`v1/sweeps?limit=2&before=${name}${LAST}`)).sweeps.filter(({ id }) => id.startsWith(name));

// Of the names of a page; they stay where the server refuses. Throws where it does not answer.
export async function wholeNames(page, names) {
  try {
    return await Promise.all(names.map((name) => whole(name, page === "sweep" ? sweeps : runs)));
  } catch (error) {
    if (!refused(error)) throw error;
    return names;
  }
}

export const isShort = (name) => name.length < LENGTH;
