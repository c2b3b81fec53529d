// Snapshots of a run: read from the server once, the newest ones kept in memory.

import { binary } from "./api.js";
import { unpack } from "./section.js";
import { decode } from "./snapshot.js";

const MOST_VOLUMES = 8; // Largest number of snapshots with all tets, some MB each.

export class Snapshots {
  // `most`: largest number of decoded snapshots, about 1 MB each.
  constructor(run, most) {
    Object.assign(this, { most, shown: new Map(), volumes: new Map(), path: `v1/runs/${encodeURIComponent(run)}/snapshots` });
  }

  // The snapshot of a message (snapshot.js).
  async read({ n }) {
    return known(this.shown, n, this.most, async () => decode(await binary(`${this.path}/${n}`)));
  }

  // All tets of a snapshot (section.js), or null for a snapshot without a file of them.
  async volume({ n, tets }) {
    return tets ? known(this.volumes, n, MOST_VOLUMES, async () => unpack(await binary(`${this.path}/${n}/tets`))) : null;
  }
}

// A kept item, which becomes the newest one, or the result of `read`; the oldest item is dropped.
async function known(kept, n, most, read) {
  const found = kept.get(n) ?? (await read());
  kept.delete(n);
  kept.set(n, found);
  if (kept.size > most) kept.delete(kept.keys().next().value);
  return found;
}
