// Snapshots of a run: each is read from the server once, and the newest are kept in memory.

import { binary } from "./api.js";
import { unpack } from "./section.js";
import { decode } from "./snapshot.js";

const MOST_VOLUMES = 8; // Largest number of snapshots with all tets in memory, some MB each.

export class Snapshots {
  // `most`: largest number of decoded snapshots in memory, about 1 MB each.
  constructor(run, most) {
    Object.assign(this, { most, shown: new Map(), volumes: new Map(), path: `v1/runs/${encodeURIComponent(run)}/snapshots` });
  }

  // Returns the snapshot of a message (snapshot.js).
  async read({ n }) {
    return known(this.shown, n, this.most, async () => decode(await binary(`${this.path}/${n}`)));
  }

  // Returns all tets of a snapshot (section.js); null for a snapshot without a file of all tets.
  async volume({ n, tets }) {
    return tets ? known(this.volumes, n, MOST_VOLUMES, async () => unpack(await binary(`${this.path}/${n}/tets`))) : null;
  }
}

// Returns an item of the store `kept`, which becomes its newest item, or else the result of `read`; the oldest item is
// dropped.
async function known(kept, n, most, read) {
  const found = kept.get(n) ?? (await read());
  kept.delete(n);
  kept.set(n, found);
  if (kept.size > most) kept.delete(kept.keys().next().value);
  return found;
}
