// Page of all runs: a table with sorting, filters and groups; marked runs can be compared.

import { Problem, call, refused } from "./api.js";
import { unanswered } from "./away.js";
import { columnsOf, ranges } from "./columns.js";
import { count, counted, exact, h, vector } from "./figures.js";
import { Grid } from "./grid.js";
import { FINAL } from "./live.js";
import { compared, grouped, matcher, sorted } from "./sorting.js";
import { recall, remember } from "./storage.js";
import { RunTable, differing, shorts } from "./runtable.js";
import { Toolbar } from "./toolbar.js";

const FIRST = 200; // Number of runs in the first answer; later pages are larger.
const PAGE = 500;
const MOST = 10000; // Largest number of runs that are shown; the command line finds older runs.
const SOON = 2000; // Time in ms between two requests while a run is open.
const LATER = 6000; // Time in ms between two requests while no run is open.
// Time in ms after which the newest page is read completely, because runs may have been removed or labels changed.
const ANEW = 60000;
const SLACK = 10; // Time in s by which the saved state of the server may lag.
const MOST_VALUES = 24; // Largest number of keys that have a column.
const MOST_TOLD = 100; // Largest number of groups whose changed keys are shown.
const NEWEST = { id: "submitted", down: true };
// Choices of the user, stored as long as the tab exists.
const kept = { text: "", state: "", days: "", open: new Set(), marked: new Set(), top: 0 };

export class RunsPage {
  // `onRefused` is called when the token is no longer valid.
  constructor(onRefused) {
    Object.assign(this, { onRefused, table: new RunTable(), sweeps: new Map(), abort: new AbortController(), cache: {} });
    this.build();
    document.title = "Runs · Conoid";
    this.start();
  }

  close() {
    kept.top = this.grid.region.scrollTop;
    this.abort.abort();
    clearTimeout(this.timer);
    this.tools.close();
    this.grid.close();
    document.removeEventListener("visibilitychange", this.woken);
    removeEventListener("resize", this.resized);
  }

  build() {
    this.tools = new Toolbar(kept, {
      change: () => this.draw(), sort: (words) => this.sortBy(words), unmark: () => { kept.marked.clear(); this.draw(); },
      compare: () => { location.hash = `#/compare/${this.chosen().map(encodeURIComponent).join("/")}`; },
    });
    this.number = h("span.note", { role: "status" });
    this.note = h("p.hint", { hidden: "" });
    this.grid = new Grid("runs", {
      sort: (column) => this.sortBy(column.id), toggle: (key) => this.toggle(key),
      mark: (row, on, far) => this.mark(row, on, far), markAll: (rows, on) => this.markAll(rows, on),
    });
    this.element = h("div.runs-page", {}, h("div.page-head", {}, h("h1", {}, "Runs"), this.number), this.tools.element, this.note, this.grid.region);
    this.grid.region.hidden = this.tools.element.hidden = true;
    this.say("Loading …");
  }

  // Server requests -------------------------------------------------------------------------------------------------

  async start() {
    addEventListener("resize", this.resized = () => this.read && this.draw());
    document.addEventListener("visibilitychange", this.woken = () => document.hidden || this.next(0));
    await this.turn();
  }

  next(wait) {
    clearTimeout(this.timer);
    if (!this.abort.signal.aborted) this.timer = setTimeout(() => this.turn(), wait);
  }

  async turn() {
    if (document.hidden && this.read) return;
    try {
      const anew = !this.read || Date.now() - this.read > ANEW || this.table.pending > 0;
      await (anew ? this.readWhole() : this.readChanged());
      this.failed = false;
    } catch (error) {
      if (this.abort.signal.aborted) return;
      if (error instanceof Problem && error.status === 401) return this.onRefused();
      this.fail(error);
    }
    this.next(this.wait);
  }

  // Time in ms until the next request.
  get wait() { return this.table.pending && !this.failed ? 200 : this.open ? SOON : LATER; }

  get open() { return [...this.table.rows.values()].some(({ state }) => !FINAL.has(state)); }

  ask(query) { return call(`v1/table?${new URLSearchParams(query)}`, { signal: this.abort.signal }); }

  // Reads all pages, newest first; the first page is shown before the others arrive.
  async readWhole() {
    const listed = this.readSweeps().catch(() => {}); // Without the list of sweeps the groups have no names.
    let next = null;
    let pending = 0;
    const all = [];
    do {
      const answer = await this.ask({ limit: next ? PAGE : FIRST, ...(next ? { cursor: next } : {}) });
      this.table.take(answer);
      pending += answer.pending;
      all.push(...answer.runs);
      next = answer.next;
      if (all.length === answer.runs.length) { await listed; this.draw(); }
    } while (next && all.length < MOST);
    this.table.keepOnly(all, !next);
    Object.assign(this.table, { pending });
    this.more = Boolean(next);
    this.read = Date.now();
    this.draw();
  }

  async readChanged() {
    const before = this.table.version;
    let query = { limit: PAGE, changed: this.table.latest - SLACK };
    for (;;) {
      const answer = await this.ask(query);
      if (answer.runs.some(({ labels, id }) => labels.sweep && !this.table.rows.has(id))) await this.readSweeps().catch(() => {});
      this.table.take(answer);
      if (!answer.next) break;
      query = { ...query, cursor: answer.next };
    }
    if (this.table.version !== before || this.failed) this.draw();
  }

  async readSweeps() {
    const { sweeps } = await call(`v1/sweeps?limit=${PAGE}`, { signal: this.abort.signal });
    this.sweeps = new Map(sweeps.map((sweep) => [sweep.id, sweep]));
  }

  fail(error) {
    this.failed = true;
    const left = this.table.rows.size ? "The runs are shown as they were read last; filters and sorting work." : "";
    this.say(h("span.problem", {}, refused(error) ? error.message : unanswered(error, left, this.wait)));
  }

  say(...children) {
    this.note.hidden = !children.length;
    this.note.replaceChildren(...children);
  }

  // Drawing -----------------------------------------------------------------------------------------------------------

  get sort() { return recall("runs.sort", NEWEST); }

  // Returns the rows that match the filters, and a column for each value that differs between these rows.
  pick() {
    const { table } = this;
    const all = [...table.rows.values()];
    const since = kept.days ? Date.now() / 1000 - 86400 * kept.days : 0;
    const rough = all.filter((row) => (!kept.state || row.state === kept.state) && row.submitted >= since);
    const every = this.columns(rough, "every");
    const rows = rough.filter(matcher(kept.text, every));
    return { rows, columns: rows.length === rough.length ? every : this.columns(rows, "shown") };
  }

  columns(rows, name) {
    const stamp = `${this.table.version} ${rows.length} ${rows[0]?.id} ${rows.at(-1)?.id} ${kept.text} ${kept.state} ${kept.days}`;
    if (this.cache[name]?.stamp !== stamp) this.cache[name] = { stamp, columns: columnsOf(rows, differing(rows, MOST_VALUES), this.table.units) };
    return this.cache[name].columns;
  }

  draw() {
    if (this.abort.signal.aborted) return;
    performance.mark?.("conoid:draw");
    const { rows, columns } = this.pick();
    const choice = recall("runs.columns", {});
    this.fit(columns, choice, rows);
    const shown = columns.filter(({ id, shown: asIs }) => id === "run" || (choice[id] ?? asIs));
    const column = columns.find(({ id }) => id === this.sort.id) ?? columns.find(({ id }) => id === NEWEST.id);
    const all = sorted(rows, column, column.id === this.sort.id ? this.sort.down : NEWEST.down);
    for (const id of [...kept.marked]) if (!this.table.rows.has(id) && this.read) kept.marked.delete(id);
    this.shorts = this.table.version === this.shortsOf ? this.shorts : shorts(this.table.rows.keys());
    this.shortsOf = this.table.version;
    this.rows = all;
    this.grid.region.hidden = !all.length;
    this.grid.draw({ columns: shown, sort: { id: column.id, down: this.sort.down }, items: this.items(all, columns), all, marked: kept.marked, shorts: this.shorts, stamp: `${this.table.version} ${all.length}` });
    this.tools.draw({ columns, choice, sort: this.sort, rows: this.table.rows.values() });
    this.drawHead(all);
    this.tell(all);
    if (kept.top) { this.grid.region.scrollTop = kept.top; kept.top = 0; }
    performance.measure?.("conoid:table", "conoid:draw");
  }

  // Returns the columns that fit into the width. Columns that the user has selected, sorts by or compares always stay.
  fit(columns, choice, rows) {
    const filter = compared(kept.text, columns);
    for (const column of columns) column.shown = (column.wanted ??= column.shown) || filter.has(column.id);
    const there = columns.filter(({ id, shown }) => choice[id] ?? shown);
    const fitting = new Set(this.grid.fitting(there, (id) => choice[id] || id === this.sort.id || filter.has(id), rows));
    for (const column of there) column.shown &&= fitting.has(column);
  }

  items(rows, columns) {
    const by = recall("runs.group", "");
    if (!by) return rows.map((row) => ({ key: row.id, content: row.content, row }));
    const groups = grouped(rows, by);
    return groups.flatMap(({ key, rows: own }) => {
      const open = kept.open.has(`${by} ${key}`);
      const varied = key && groups.length <= MOST_TOLD ? ranges(own, columns) : "";
      const group = { ...this.heading(by, key, own, columns), key: `${by} ${key}`, varied, rows: own, open };
      const content = JSON.stringify([group.title, group.note, varied, own.length, open]);
      return [{ key: `${by} ${key}`, content, group }, ...(open ? own.map((row) => ({ key: row.id, content: row.content, row })) : [])];
    });
  }

  heading(by, key, rows, columns) {
    if (by === "case") return { title: key };
    if (!key) return { title: "no sweep" };
    const sweep = this.sweeps.get(key);
    const done = rows.filter(({ state }) => FINAL.has(state)).length;
    const brief = shorts(this.sweeps.keys()).get(key) ?? key;
    const failed = rows.filter(({ state }) => FINAL.has(state) && state !== "succeeded").length;
    if (sweep?.search) return { title: `${sweep.name}, adaptive`, brief, href: `#/sweeps/${encodeURIComponent(key)}`, note: soughtFor(sweep.search, (name) => columns.find(({ full }) => full === name)?.title ?? name) };
    const note = `${done} of ${count(sweep?.total ?? rows.length)} done${failed ? `, ${count(failed)} without a result` : ""}`;
    return { title: sweep?.name ?? rows[0].name, brief, href: `#/sweeps/${encodeURIComponent(key)}`, note };
  }

  drawHead(rows) {
    const total = this.table.rows.size;
    const reading = this.table.pending ? `, results of ${count(this.table.pending)} are being read` : "";
    this.number.textContent = (rows.length === total ? counted(total, "run") : `${count(rows.length)} of ${counted(total, "run")}`) + reading;
    this.tools.element.hidden = !total;
  }

  tell(rows) {
    if (!this.table.rows.size) return this.say(beginning());
    if (!rows.length) return this.say("No run matches. ", h("button.quiet", { type: "button", onclick: () => this.showAll() }, "Show all runs"));
    if (this.more) return this.say(`The newest ${count(this.table.rows.size)} are shown; `, h("code", {}, "conoid runs --until DATE"), " finds older ones.");
    return this.say();
  }

  showAll() {
    Object.assign(kept, { text: "", state: "", days: "" });
    this.tools.reset();
    this.draw();
  }

  // Actions -----------------------------------------------------------------------------------------------------------

  // Sorts by a column, the second time in reverse order; the argument may also be "ID up" or "ID down".
  sortBy(words) {
    const [, id, way] = /^(.*?)(?: (up|down))?$/.exec(words);
    const { sort } = this;
    const first = id === "submitted" || id.startsWith("result:"); // Newest runs and largest results come first.
    remember("runs.sort", { id, down: way ? way === "down" : sort.id === id ? !sort.down : first });
    this.draw();
  }

  toggle(key) {
    if (!kept.open.delete(key)) kept.open.add(key);
    this.draw();
  }

  // Marks a row; with Shift, all rows from the last marked row to this one.
  mark(row, on, far) {
    const from = far ? this.rows.findIndex(({ id }) => id === this.last) : -1;
    const to = this.rows.findIndex(({ id }) => id === row.id);
    this.last = row.id;
    this.markAll(from < 0 ? [row] : this.rows.slice(Math.min(from, to), Math.max(from, to) + 1), on);
  }

  markAll(rows, on) {
    for (const { id } of rows) {
      if (on) kept.marked.add(id);
      else kept.marked.delete(id);
    }
    this.draw();
  }

  // Returns the marked runs in the order of the table, hidden runs last.
  chosen() {
    const shown = this.rows.filter(({ id }) => kept.marked.has(id)).map(({ id }) => id);
    return [...shown, ...[...kept.marked].filter((id) => !shown.includes(id))];
  }
}

// Returns a text with the goal of an adaptive sweep and its present answer; `titled(name)` is the title of a column.
function soughtFor({ key, result, threshold, result_unit: up, bracket, unit }, titled) {
  const found = bracket ? vector([(bracket[0] + bracket[1]) / 2, (bracket[1] - bracket[0]) / 2], unit, 4, " ± ") : "not bracketed";
  return `${titled(result)} = ${exact(threshold, up)} at ${titled(key)} ${found}`;
}

const beginning = () => h("div.empty", {}, h("h2", {}, "No runs yet"),
  h("p", {}, h("a", { href: "#/new?case=taylor_copper" }, "Start from a shipped case"), " on this page, or from a terminal:"),
  h("pre", {}, h("code", {}, "# the shipped cases\nconoid cases\n# submits one; it appears here\nconoid submit taylor_copper\n# a run for each value\nconoid sweep taylor_copper --set \"parts[0].velocity[2]=-150 m/s,-200 m/s\"")));
