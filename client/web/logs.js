// Messages of a run: warnings, log, and the log file of each rank.

import { tail } from "./api.js";
import { clock, count, counted, h, size } from "./figures.js";
import { fold } from "./storage.js";

// List of the warnings and errors of the whole run, each text once.
export class Warnings {
  constructor() {
    this.list = h("ul.warnings", { tabindex: 0, "aria-label": "warnings" });
    this.title = h("span");
    this.element = h("section.card.warned", { "aria-label": "warnings", hidden: "" }, fold("warnings", false, this.title, this.list));
  }

  draw({ warnings }) {
    if (this.drawn === warnings.size) return;
    this.drawn = warnings.size;
    this.element.hidden = !warnings.size;
    this.title.replaceChildren(h("b", {}, counted(warnings.size, "warning")), h("span.first", {}, ` ${[...warnings.keys()][0]}`));
    this.list.replaceChildren(...[...warnings].map(([text, level]) => h(`li.${level}`, {}, text)));
  }
}

// Tabs of the logs; the arrow keys move between the tabs.
export class Logs {
  constructor(live) {
    Object.assign(this, { live, tab: "messages", ranks: 0, logged: "" });
    this.tabs = h("div.tabs", { role: "tablist", "aria-label": "log of", onkeydown: (event) => this.key(event) });
    this.lines = h("pre.log", { id: "log-lines", tabindex: 0, role: "tabpanel", "aria-label": "log" });
    this.element = h("section.card.logs", {}, h("div.card-head", {}, h("h2", {}, "Log"), this.tabs), this.lines);
  }

  get names() { return ["messages", ...Array.from({ length: this.ranks }, (_, rank) => String(rank)), "launcher"]; }

  async choose(tab) {
    this.tab = tab;
    this.head();
    this.tabs.querySelector("[aria-selected=true]")?.focus();
    this.logged = "";
    if (tab === "messages") return this.draw();
    const lines = await tail(this.live.run, tab).catch((error) => error.message);
    if (this.tab !== tab) return;
    this.lines.replaceChildren(lines || h("span.hint", {}, "nothing yet"));
    this.lines.scrollTop = this.lines.scrollHeight;
  }

  key(event) {
    const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (move) this.choose(this.names.at((this.names.indexOf(this.tab) + move) % this.names.length));
  }

  head() {
    this.tabs.replaceChildren(...this.names.map((name) => h("button.tab", { type: "button", role: "tab", "aria-controls": "log-lines",
      "aria-selected": String(name === this.tab), tabindex: name === this.tab ? 0 : -1, onclick: () => this.choose(name) },
    Number.isNaN(Number(name)) ? name : `rank ${name}`)));
  }

  draw(ranks) {
    if (ranks !== undefined && ranks !== this.ranks) {
      this.ranks = ranks;
      this.head();
    }
    const { log, leftOut } = this.live;
    const state = `${this.tab} ${log.length} ${log.at(-1)?.seq}`;
    if (this.tab !== "messages" || this.logged === state) return;
    this.logged = state;
    const atEnd = this.lines.scrollTop + this.lines.clientHeight >= this.lines.scrollHeight - 8;
    const left = leftOut ? [h("div.hint", {}, `${counted(leftOut, "message")} in the middle left out; journal.jsonl has all`)] : [];
    this.lines.replaceChildren(...left, ...log.map(line));
    if (atEnd) this.lines.scrollTop = this.lines.scrollHeight;
  }
}

const line = (message) => h(`div.${message.level ?? "state"}`, {}, h("time", {}, clock(message.wall)), `  ${words(message)}`);

// Returns a message of the log, of a state or of a checkpoint as a text line for people.
export function words({ type, text, rank, state, cause, message, step, bytes }) {
  if (type === "status") return [state, cause && cause !== state ? `(${cause})` : "", message && `: ${message}`].filter(Boolean).join(" ").replace(" : ", ": ");
  if (type === "checkpoint") return `checkpoint of step ${count(step)}, ${size(bytes)}${cause ? `: ${cause}` : ""}`;
  return rank ? `[rank ${rank}] ${text}` : text;
}
