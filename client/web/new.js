// Page for a new run: the case in an editor, the files that the case names, the check by the server, and the start.

import { Problem, call, send } from "./api.js";
import { unanswered } from "./away.js";
import { isJson, lineOf, valueOf, withKey } from "./casetext.js";
import { asToml } from "./casetoml.js";
import { Editor } from "./editor.js";
import { counted, h } from "./figures.js";
import { Outbox } from "./outbox.js";
import { recall, remember } from "./storage.js";
import { filesTable, verdict } from "./validation.js";

const IDLE = 500; // Time in ms without a key press after which the case is checked.
const AGAIN = 3000; // Time in ms after which a request is repeated if the server does not answer.
const DRAFT = 200000; // Largest number of characters of a case that the browser stores.
const OWN = /^(restart|keep|sweep.*|point)$/; // Names of labels that belong to a single run and are not copied.
const FIELDS = [["title", "Title", "", "title"], ["ranks", "Ranks", "run", "ranks"], ["threads", "Threads", "run", "threads"]];

export class NewPage {
  // `query` may name a run whose case is loaded (`from`), or a shipped case (`case`).
  constructor(query, onRefused) {
    Object.assign(this, { from: query.get("from") ?? "", onRefused, checks: null, checked: null, abort: new AbortController(), key: fresh() });
    this.outbox = new Outbox(this.from, () => this.news());
    this.build();
    this.listen();
    this.begin(query.get("case"));
    document.title = "New run · Conoid";
  }

  // Files may be dropped anywhere on the page; otherwise the browser would open a dropped file and leave the page.
  listen() {
    const { signal } = this.abort;
    const mark = (over) => this.element.classList.toggle("dropping", over);
    document.addEventListener("dragover", (event) => {
      event.preventDefault();
      mark(true);
    }, { signal });
    document.addEventListener("dragleave", ({ relatedTarget }) => relatedTarget || mark(false), { signal });
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      mark(false);
      this.drop([...event.dataTransfer.files]);
    }, { signal });
  }

  close() {
    this.abort.abort();
    this.outbox.close();
    clearTimeout(this.timer);
  }

  build() {
    this.editor = new Editor("the case", () => {
      this.asked = false;
      this.typed();
    });
    this.gallery = h("select", { "aria-label": "start from a shipped case", onchange: () => this.take(this.gallery.value) }, h("option", { value: "" }, "a shipped case …"));
    const chosen = h("input", { type: "file", multiple: "", "aria-label": "choose a case and its files", onchange: () => this.drop([...chosen.files]) });
    this.fields = FIELDS.map(([id, words, table, name]) => {
      const input = h("input", { type: table ? "number" : "text", min: 1, id: `new-${id}`, placeholder: { ranks: "1", threads: "all" }[id] ?? "", oninput: () => this.set(table, name, input) });
      return { input, table, name, element: h(`label.form-row.of-${id}`, {}, h("span", {}, words), input) };
    });
    this.labels = h("input", { type: "text", placeholder: "study=speeds, mesh=fine" });
    this.startButton = h("button", { type: "button", disabled: "", onclick: () => this.start() }, "Start");
    this.status = h("p", { role: "status" });
    this.verdict = h("div");
    this.files = h("div");
    const file = h("label.button", {}, "Choose files", chosen);
    this.element = h("div.work.new", { onkeydown: (event) => this.pressed(event) },
      h("div.run-head", {}, h("h1", {}, this.from ? "Start again with changes" : "New run"), h("span.grow"), this.gallery, file),
      h("div.bench", {},
        h("section.card.stage-editor", { "aria-label": "case" }, h("p.hint", {}, "Paste a case, drop it here with the files that it names, or start from a shipped case."), this.editor.element),
        h("aside.now", { "aria-label": "check and start" },
          h("section.card.start", { "aria-label": "start" }, ...this.fields.map(({ element }) => element), h("label.form-row", {}, h("span", {}, "Labels"), this.labels),
            h("div.actions", {}, this.startButton, h("span.hint", {}, "Ctrl+Enter")), this.status),
          h("section.card", { "aria-label": "check" }, h("h2", {}, "Check"), this.verdict),
          h("section.card", { "aria-label": "files of the case" }, h("h2", {}, "Files"), this.files))));
  }

  // Case source ------------------------------------------------------------------------------------------------------------

  async begin(shipped) {
    this.draw();
    const { signal } = this.abort;
    try {
      if (this.from) await this.open(signal);
      else if (shipped) await this.read(shipped);
      else this.show(recall("draft", ""));
      const { cases } = await call("v1/cases", { signal });
      this.gallery.append(...cases.map(({ name, title }) => h("option", { value: name, title }, `${name}: ${title}`)));
    } catch (error) {
      this.fail(error);
    }
  }

  async open(signal) {
    const path = `v1/runs/${encodeURIComponent(this.from)}`;
    const info = await call(path, { signal });
    this.labels.value = Object.entries(info.labels ?? {}).filter(([name]) => !OWN.test(name)).map((pair) => pair.join("=")).join(", ");
    this.show(asToml(await (await send(`${path}/files/${info.case_file}`, { signal })).text()));
  }

  async read(name) {
    this.outbox.shipped = name;
    this.show(await (await send(`v1/cases/${encodeURIComponent(name)}`, { signal: this.abort.signal })).text());
  }

  async take(name) {
    if (!name || (this.editor.text.trim() && !confirm("Replace the case in the editor?"))) return;
    await this.read(name).catch((error) => this.fail(error));
  }

  show(text) {
    this.editor.text = text;
    this.typed();
  }

  // A dropped case is put into the editor; all other dropped files are available for the case.
  async drop(files) {
    const cases = files.filter(({ name }) => /\.(toml|json)$/i.test(name));
    if (cases.length) this.show(await cases[0].text());
    for (const file of files) if (file !== cases[0]) this.outbox.add(file);
  }

  set(table, name, input) {
    if (input.value === "") return;
    this.editor.text = withKey(this.editor.text, table, name, table ? String(Math.max(1, Math.round(Number(input.value)))) : JSON.stringify(input.value));
    this.typed();
  }

  pressed(event) {
    if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey) || this.starting) return;
    event.preventDefault();
    this.asked = true;
    this.draw();
  }

  // Starts the run if the user has asked for the start; the start waits for the end of a check and for `waits` files.
  startIfAsked(current, waits) {
    if (!this.asked || (!current && this.editor.text.trim()) || (waits && this.checks?.valid)) return;
    this.asked = false;
    if (!this.startButton.disabled) this.start();
  }

  // The check -------------------------------------------------------------------------------------------------------------

  typed() {
    this.key = fresh();
    if (!this.from && this.editor.text.length < DRAFT) remember("draft", this.editor.text);
    this.later(IDLE);
    this.draw();
  }

  later(ms) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.check(), ms);
  }

  // The page runs one check at a time. Text that is typed during a check is checked afterwards.
  async check() {
    const { text } = this.editor;
    if (this.checking || this.checked === text || this.abort.signal.aborted) return;
    if (!text.trim()) return this.judged(text, null);
    this.checking = true;
    this.draw();
    try {
      this.judged(text, await this.ask("v1/cases:validate", text));
    } catch (error) {
      this.checked = null;
      this.fail(error);
      if (!(error instanceof Problem) || error.status >= 500 || error.status === 429) this.later(AGAIN);
    }
    this.checking = false;
    this.draw();
    if (this.checked !== null && this.editor.text !== this.checked) this.later(0);
    return undefined;
  }

  async ask(path, text, headers = {}) {
    const type = isJson(text) ? "application/json" : "application/toml";
    return (await send(path, { method: "POST", headers: { "Content-Type": type, ...headers }, body: text, signal: this.abort.signal })).json();
  }

  judged(text, checks) {
    Object.assign(this, { checked: text, checks });
    this.say("");
    this.news();
  }

  // Writes known hashes into the case; a new file requires a new check.
  news() {
    if (this.abort.signal.aborted) return;
    const named = this.checks?.files ?? [];
    if (this.checked === this.editor.text) {
      const text = this.outbox.ready(this.editor.text, named);
      const here = named.every((file) => this.outbox.stateOf(file).state === "sent");
      if (text !== this.editor.text) this.show(text);
      else if (here && this.waited) [this.checked, this.waited] = [null, this.later(0)];
      this.waited = Boolean(named.length) && !here;
    }
    this.draw();
  }

  // The start -------------------------------------------------------------------------------------------------------------

  // Starts the run. Equal cases have equal idempotency keys, so that a repeated start makes one run.
  async start() {
    const labels = this.labels.value.split(",").map((one) => one.trim()).filter(Boolean);
    const query = labels.map((label) => `label=${encodeURIComponent(label)}`).join("&");
    this.starting = true;
    this.draw();
    try {
      const { id } = await this.ask(`v1/runs${query ? `?${query}` : ""}`, this.editor.text, { "Idempotency-Key": this.key });
      remember("draft", "");
      location.hash = `#/runs/${encodeURIComponent(id)}`;
    } catch (error) {
      this.fail(error);
    }
    this.starting = false;
    this.draw();
  }

  fail(error) {
    if (this.abort.signal.aborted) return;
    if (error.status === 401) this.onRefused();
    else this.say(error instanceof Problem ? error.message : unanswered(error, "The text stays in the editor.", this.starting ? 0 : AGAIN));
  }

  say(text) { this.status.replaceChildren(text ? h("span.problem", {}, text) : ""); }

  // Shows the problems of the case; missing files are shown in the list of files instead.
  problems(named) {
    const wanted = new Set(named.filter((file) => !file.sha256 || this.outbox.stateOf(file).state !== "sent").map(({ key }) => `${key}.sha256`));
    return (this.checks?.problems ?? []).filter(({ key }) => !wanted.has(key));
  }

  draw() {
    const { text } = this.editor;
    const current = this.checked === text;
    const named = once(this.checks?.files ?? []);
    const waits = named.filter((file) => this.outbox.stateOf(file).state !== "sent").length;
    this.startButton.disabled = !(current && this.checks?.valid && !waits && !this.starting);
    this.startButton.textContent = this.starting ? "Starting …" : this.asked && !current ? "Starts after the check" : waits ? `Waits for ${counted(waits, "file")}` : "Start";
    for (const { input, table, name } of this.fields) if (document.activeElement !== input) input.value = valueOf(text, table, name);
    const problems = this.problems(this.checks?.files ?? []);
    const lines = problems.map((one) => place(text, one));
    const state = `${text.length} ${current} ${this.checking} ${waits} ${lines}`;
    if (this.seen !== state || this.shown !== this.checks) {
      [this.seen, this.shown] = [state, this.checks];
      this.editor.mark(lines.filter((line) => line >= 0));
      this.verdict.replaceChildren(verdict(text, current ? "" : named.length ? "checking the case and reading its files …" : "checking …", this.checks && { ...this.checks, problems }, lines, (line) => this.editor.goTo(line)));
    }
    this.files.replaceChildren(this.checks || !text.trim() ? filesTable(named, this.outbox) : h("p.hint", {}, "checking …"));
    this.startIfAsked(current, waits);
  }
}

// Returns the line of a problem: the line of its key, or the line number in its message.
function place(text, { key, message }) {
  const line = /at line (\d+)/.exec(message);
  const named = key || /^([a-z][\w.[\]]*) = /.exec(message)?.[1];
  return line ? Number(line[1]) - 1 : named ? lineOf(text, named) : -1;
}

// Returns the named files; a file that several parts name is listed once.
export const once = (named) => [...new Map(named.map((file) => [file.path, file])).values()];

const fresh = () => [...crypto.getRandomValues(new Uint8Array(16))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
