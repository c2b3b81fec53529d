// What is to be said of a run that waits, or that has not ended as it should: why, how far it came, the end of its log,
// and what can be done next.

import { call, tail } from "./api.js";
import { h, percent, si, words } from "./figures.js";
import { ended } from "./numbers.js";

const LINES = 12; // Of the end of the log.
const CAUSES = {
  input: "its case cannot be run", mesh: "its mesh cannot be made", diverged: "its numbers have grown beyond all bounds", energy: "its energy does not close",
  memory: "it needs more memory than there is", walltime: "its wall time was used up", steps: "run.max_steps was used up before run.end_time",
  preempted: "the batch system has taken its place away", node: "a process or a machine of it is gone", launch: "it could not be started",
  storage: "a file could not be written", cancelled: "it was cancelled", service: "the server could not go on with it",
};
const HELP = {
  input: "Change the keys that the message names, and start again.", mesh: "Change the mesh, and start again.",
  diverged: "Look at the last snapshot and at dt before the end; a smaller numerics.dt_safety or erosion of worn tets helps.",
  energy: "The energy by term shows what has grown until then.",
  memory: "Use larger elements, or a machine with more memory.", walltime: "Go on from the last checkpoint, or allow more in run.wall_time.",
  steps: "Go on with a larger run.max_steps; dt is held down by what stands beside it.", storage: "Make room on the disk, then go on from the last checkpoint.",
};
const POINT = /^checkpoints\/(\d+)\/manifest\.json$/;
const FATED = new Set(["input", "mesh", "diverged", "energy"]); // Causes that the same case meets again.
const BAD = new Set(["failed", "lost", "timed_out", "cancelled"]);

export class RunState {
  // `files()` promises the files of the run, null where they are not known.
  constructor(run, files) {
    Object.assign(this, { run, files, told: "" });
    this.path = `v1/runs/${encodeURIComponent(run)}`;
    this.element = h("section.card.situation", { "aria-label": "what has happened", hidden: "" });
  }

  draw(live, outcome = null) {
    const state = BAD.has(live.state) ? live.state : "";
    const key = `${state} ${live.cause} ${live.message} ${Boolean(outcome)}`;
    this.element.hidden = !state;
    if (!state || this.told === key) return;
    this.told = key;
    this.element.className = `card situation ${state}`;
    this.fill(live, outcome);
  }

  async fill(live, outcome = null) {
    const turn = (this.turn = (this.turn ?? 0) + 1);
    const log = h("pre.log", { tabindex: 0, role: "region", "aria-label": "end of the log", hidden: "" });
    const actions = h("div.actions");
    this.element.replaceChildren(h("div", {}, h("h2", {}, sentence(live)), live.message ? h("p", {}, live.message) : "",
      h("p.hint", {}, reached(live, outcome)), advice(live.cause, outcome), actions), log);
    const [files, lines] = await Promise.all([this.files(), this.end(live)]);
    if (turn !== this.turn) return;
    const point = FATED.has(live.cause) ? null : files?.filter(({ path }) => POINT.test(path)).at(-1);
    if (point) actions.append(this.restart(Number(POINT.exec(point.path)[1]), live));
    else if (files && !FATED.has(live.cause)) actions.append(h("span.hint", {}, "It has left no checkpoint to go on from; open the case, change it and start again."));
    log.hidden = !lines;
    log.replaceChildren(lines);
    log.scrollTop = log.scrollHeight;
  }

  // A run that has used up its steps goes on with twice as many.
  restart(step, { cause, finished }) {
    const most = cause === "steps" ? 2 * Math.max(step, finished?.steps ?? 0) : 0;
    const button = h("button", { type: "button", onclick: async () => {
      button.disabled = true;
      try {
        const { id } = await call(`${this.path}:restart${most ? `?max_steps=${most}` : ""}`, { method: "POST" });
        location.hash = `#/runs/${encodeURIComponent(id)}`;
      } catch (error) {
        button.after(h("span.problem", {}, error.message));
        button.disabled = false;
      }
    } }, `Go on from step ${step}${most ? ` with run.max_steps = ${most}` : ""}`);
    return button;
  }

  // Of the first log that has any: of the launcher where a run never began, else of rank 0.
  async end(live) {
    for (const name of live.progress ? ["0", "launcher"] : ["launcher", "0"]) {
      const text = (await tail(this.run, name).catch(() => "")).trimEnd();
      if (text) return text.split("\n").slice(-LINES).join("\n");
    }
    return "";
  }
}

export const sentence = ({ state, cause }) => `${{ failed: "Failed", lost: "Lost", timed_out: "Timed out", cancelled: "Cancelled" }[state]}${cause && cause !== state ? `: ${CAUSES[cause] ?? cause}` : ""}`;

function advice(cause, outcome) {
  const made = cause === "energy" ? outcome?.made?.[0] : null;
  const most = made ? `Of the lines of the ledger ${words(made.line)} has made the most: ${percent(made.share)} of the energy, at ${si(made.time, "s")}.` : "";
  return HELP[cause] || most ? h("p", {}, [HELP[cause], most].filter(Boolean).join(" ")) : "";
}

function reached({ progress, snapshots }, outcome) {
  if (!progress) return "It had not begun its first step.";
  const { t, step } = ended(progress, outcome);
  const last = snapshots.at(-1);
  return `It had come to ${si(t, "s")} of ${si(progress.end_time, "s")}, step ${step}${last ? `; the last snapshot, of ${si(last.t, "s")}, is shown below` : ""}.`;
}
