// The list of runs.

import { Problem, call, refused } from "./api.js";
import { duration, h, meter, moment, pill } from "./figures.js";
import { FINAL } from "./live.js";

const MOST_ASKED = 8; // A list tells no progress; this many running ones are asked for theirs.

export class RunsPage {
  // `onRefused` is called where the server does not accept the token any more.
  constructor(onRefused) {
    this.onRefused = onRefused;
    this.body = h("tbody");
    this.note = h("p.hint", { hidden: "" });
    const head = h("thead", {}, h("tr", {}, ["run", "state", "progress", "ranks", "submitted", "compare"].map((name) => h("th", { scope: "col" }, name))));
    this.marked = []; // Ids of runs to be compared, the last two.
    this.compare = h("button.quiet", { type: "button", disabled: "", onclick: () => { location.hash = `#/compare/${this.marked.map(encodeURIComponent).join("/")}`; } }, "Compare two");
    this.table = h("table.runs", {}, head, this.body);
    this.element = h("div", {}, h("div.card-head", {}, h("h1", {}, "Runs"), h("span.note", {}, this.compare)), h("div.card", {}, this.table, this.note));
    document.title = "Conoid";
    this.read();
    this.timer = setInterval(() => document.hidden || this.read(), 3000);
  }

  close() {
    clearInterval(this.timer);
    this.closed = true;
  }

  async read() {
    try {
      const { runs, next } = await call("v1/runs?limit=100");
      await Promise.all(runs.filter((run) => run.state === "running").slice(0, MOST_ASKED).map(async (run) => {
        Object.assign(run, await call(`v1/runs/${encodeURIComponent(run.id)}`));
      }));
      if (!this.closed) this.draw(runs, next);
    } catch (error) {
      if (this.closed) return;
      if (error instanceof Problem && error.status === 401) this.onRefused();
      else this.say(h("span.problem", {}, refused(error) ? error.message : `No answer from the server: ${error.message}`));
    }
  }

  say(...children) {
    this.note.hidden = !children.length;
    this.note.replaceChildren(...children);
  }

  mark(id) {
    this.marked = this.marked.includes(id) ? this.marked.filter((one) => one !== id) : [...this.marked, id].slice(-2);
    this.compare.disabled = this.marked.length !== 2;
    for (const box of this.body.querySelectorAll("[data-marks]")) box.checked = this.marked.includes(box.dataset.marks);
  }

  draw(runs, next) {
    const focused = document.activeElement?.dataset?.marks;
    this.body.replaceChildren(...runs.map((run) => row(run, this.marked.includes(run.id), () => this.mark(run.id))));
    if (focused) this.body.querySelector(`[data-marks="${CSS.escape(focused)}"]`)?.focus();
    this.table.hidden = !runs.length;
    if (next) this.say(`The newest ${runs.length} are shown; `, h("code", {}, "conoid ls --limit 1000"), " lists more.");
    else if (runs.length) this.say();
    else this.say("No runs yet. ", h("a", { href: "#/new?case=taylor_copper" }, "Begin with a shipped case"), ", or on the command line: ", h("code", {}, "conoid submit taylor_copper"));
  }
}

function row(run, marked, mark) {
  const link = `#/runs/${encodeURIComponent(run.id)}`;
  const open = () => { location.hash = link; };
  const share = run.state === "succeeded" ? 1 : run.progress ? run.progress.t / run.progress.end_time : 0;
  const took = FINAL.has(run.state) && run.started ? ` · ${duration(run.finished - run.started)}` : "";
  const box = h("input", { type: "checkbox", "data-marks": run.id, "aria-label": `compare ${run.name} ${run.id}`, checked: marked && "", onchange: mark });
  return h("tr", { onclick: open },
    h("td", {}, h("a.name", { href: link }, run.name), h("span.id", {}, run.id)),
    h("td", { title: run.message || run.reason }, pill(run.state)),
    h("td.bar", { style: { minWidth: "120px" } }, meter(run.state, share)),
    h("td.ranks-of", {}, run.threads > 1 ? `${run.ranks}x${run.threads}` : String(run.ranks)),
    h("td.right.when", {}, moment(run.submitted) + took),
    h("td.mark", { onclick: (event) => event.stopPropagation() }, box));
}
