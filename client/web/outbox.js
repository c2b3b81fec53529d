// Upload of the files that a case names: the files are hashed in the browser, and sent if the server lacks them.

import { binary } from "./api.js";
import { withHash } from "./casetext.js";
import { sendFile, there } from "./sending.js";
import { hashed } from "./sha256.js";

const baseOf = (path) => path.split(/[/\\]/).at(-1);
const ENDING = /\.[a-z0-9]{1,8}$/;

export class Outbox {
  // `run`: run whose case is edited, "" for none. `shipped`: shipped case whose files are needed. `onChange` is called
  // after a change of a file.
  constructor(run, onChange) {
    Object.assign(this, { run, onChange, shipped: "", files: new Map(), known: new Map(), abort: new AbortController() });
  }

  close() { this.abort.abort(); }

  // Adds a file that the user has chosen; the file replaces a file of the same name.
  async add(file) {
    const entry = { file, sha256: "", state: "hashing", done: 0, error: "" };
    this.files.set(file.name, entry);
    await this.attempt(entry, async () => {
      const sha256 = await hashed(file, (done) => this.update(entry, { done }), this.abort.signal);
      this.update(entry, { sha256, state: "ready" });
    });
  }

  remove(name) {
    this.files.delete(name);
    this.onChange();
  }

  update(entry, news) {
    Object.assign(entry, news);
    this.onChange();
  }

  async attempt(entry, work) {
    try {
      await work();
    } catch (error) {
      if (!this.abort.signal.aborted) this.update(entry, { state: "failed", error: error.message });
    }
  }

  // Returns the case with the hashes of known files, and begins the upload of the named files. `named`: [{ path, sha256
  // }].
  ready(text, named) {
    return named.reduce((made, { path, sha256 }) => {
      const entry = this.files.get(baseOf(path));
      if (!entry?.sha256) {
        if (!entry && (sha256 || this.shipped)) this.look(path, sha256);
        return made;
      }
      if (entry.state === "ready") this.send(entry);
      return sha256 === entry.sha256 ? made : withHash(made, path, entry.sha256);
    }, text);
  }

  send(entry) {
    this.update(entry, { state: "sending", done: 0 });
    return this.attempt(entry, async () => {
      await sendFile(entry.file, entry.sha256, (done) => this.update(entry, { done }), this.abort.signal);
      this.known.set(entry.sha256, { whole: true });
      this.update(entry, { state: "sent" });
    });
  }

  // Asks whether the server has a file with this hash; if not, the copy in the edited run is sent again.
  async look(path, sha256) {
    if (!sha256) return this.fetch(path);
    if (this.known.has(sha256)) return undefined;
    const { signal } = this.abort;
    this.known.set(sha256, { whole: false, state: "asking" });
    const { whole } = await there(sha256, signal).catch(() => ({ whole: false }));
    this.known.set(sha256, { whole });
    if (!whole && this.run && !signal.aborted) await this.copy(path, sha256).catch(() => {});
    this.onChange();
    return undefined;
  }

  // Fetches a file of a shipped case once.
  async fetch(path) {
    const place = `v1/cases/${encodeURIComponent(this.shipped)}/files/${encodeURIComponent(path)}`;
    if (this.known.has(place)) return;
    this.known.set(place, { whole: false });
    const bytes = await binary(place, { signal: this.abort.signal }).catch(() => null);
    if (bytes) await this.add(new File([bytes], baseOf(path)));
  }

  async copy(path, sha256) {
    const { signal } = this.abort;
    const name = `${sha256}${ENDING.exec(path.toLowerCase())?.[0] ?? ""}`;
    const bytes = await binary(`v1/runs/${encodeURIComponent(this.run)}/files/files/${name}`, { signal });
    await sendFile(new Blob([bytes]), sha256, () => {}, signal);
    this.known.set(sha256, { whole: true });
  }

  // Returns the state of a file that the case names: { state, share, error }.
  stateOf({ path, sha256 }) {
    const entry = this.files.get(baseOf(path));
    if (entry) return { ...entry, share: entry.file.size ? entry.done / entry.file.size : 1 };
    if (!sha256) return { state: "missing" };
    const known = this.known.get(sha256);
    return { state: known?.whole ? "sent" : known && !known.state ? "missing" : "asking" };
  }

  // Returns the files that the case does not name.
  spare(named) {
    const names = new Set(named.map(({ path }) => baseOf(path)));
    return [...this.files.keys()].filter((name) => !names.has(name));
  }
}
