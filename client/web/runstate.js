// Notice for a run that waits, or that ended without success: reason, progress, end of the log, and what the user can
// do next.

import { call, tail } from "./api.js";
import { h, rough, si, words } from "./figures.js";
import { ended } from "./numbers.js";

const LOGS = { 0: "log/rank-0.log", launcher: "log/launcher.log" };
const LINES = 12; // Number of lines of the log that are shown.
const NOISE = /^MPICH: freeing /; // Lines that MPICH prints at the end of a process that has failed.
const CAUSES = {
  input: "its case cannot be run", mesh: "its mesh cannot be made", diverged: "its solution has diverged", energy: "its energy does not close",
  memory: "it ran out of memory", walltime: "the run reached its limit of wall time", steps: "it reached run.max_steps before run.end_time",
  preempted: "the batch system has stopped the job of the run", node: "a process or a machine of the run has failed", launch: "it could not be started",
  storage: "a file could not be written", cancelled: "it was cancelled", service: "the server could not continue the run",
};
const HELP = {
  input: "Change the keys that the message names, and start again.", mesh: "Change the mesh, and start again.",
  diverged: "Check the last snapshot and dt before the end; a smaller numerics.dt_safety or erosion of distorted tets may help.",
  energy: "The chart of energy by term shows which term has grown.",
  memory: "Use larger elements, or a machine with more memory.", walltime: "Continue from the last checkpoint, or increase run.max_wall_time.",
  steps: "Continue with a larger run.max_steps; the limiter of dt is shown beside it.", storage: "Make space for the files of the run, then continue from the last checkpoint.",
};
const POINT = /^checkpoints\/(\d+)\/manifest\.json$/;
// Causes of failure that would recur with the same case.
const FATED = new Set(["input", "mesh", "diverged", "energy"]);
const BAD = new Set(["failed", "lost", "timed_out", "cancelled"]);

export class RunState {
  // `files()` resolves to the files of the run, or null if unknown.
  constructor(run, files) {
    Object.assign(this, { run, files, keyShown: "" });
    this.path = `v1/runs/${encodeURIComponent(run)}`;
    this.element = h("section.card.situation", { "aria-label": "what has happened", hidden: "" });
  }

  draw(live, outcome = null) {
    const state = BAD.has(live.state) ? live.state : "";
    const key = `${state} ${live.cause} ${live.message} ${Boolean(outcome)}`;
    this.element.hidden = !state;
    if (!state || this.keyShown === key) return;
    this.keyShown = key;
    this.element.className = `card situation ${state}`;
    this.fill(live, outcome);
  }

  async fill(live, outcome = null) {
    const turn = (this.turn = (this.turn ?? 0) + 1);
    const log = h("pre.log", { tabindex: 0, role: "region", "aria-label": "end of the log", hidden: "" });
    const actions = h("div.actions");
    this.element.replaceChildren(h("div", {}, h("h2", {}, sentence(live)), live.message ? h("p", {}, live.message) : "",
      h("p.hint", {}, reached(live, outcome)), advice(live.cause, outcome), actions), log);
    const files = await this.files();
    const lines = await this.end(live, files);
    if (turn !== this.turn) return;
    const point = FATED.has(live.cause) ? null : files?.filter(({ path }) => POINT.test(path)).at(-1);
    if (point) actions.append(this.restart(Number(POINT.exec(point.path)[1]), live));
    else if (files && !FATED.has(live.cause)) actions.append(h("span.hint", {}, "It has no checkpoint to continue from; open the case, change it and start again."));
    log.hidden = !lines;
    log.replaceChildren(lines);
    log.scrollTop = log.scrollHeight;
  }

  // A run that has used all its steps continues with twice as many steps.
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
    } }, `Continue from step ${step}${most ? ` with run.max_steps = ${most}` : ""}`);
    return button;
  }

  // Returns the end of the first log that has text: the log of the launcher if no rank started, else of rank 0. Files
  // that do not exist are not requested, because a browser logs an answer 404 as an error of the page.
  async end(live, files) {
    const there = new Set(files?.map(({ path }) => path));
    const logs = live.progress ? ["0", "launcher"] : ["launcher", "0"];
    for (const name of logs.filter((one) => !files || there.has(LOGS[one]))) {
      const text = (await tail(this.run, name).catch(() => "")).trimEnd();
      const lines = text.split("\n").filter((line) => !NOISE.test(line));
      if (lines.join("")) return lines.slice(-LINES).join("\n");
    }
    return "";
  }
}

export const sentence = ({ state, cause }) => `${{ failed: "Failed", lost: "Lost", timed_out: "Timed out", cancelled: "Cancelled" }[state]}${cause && cause !== state ? `: ${CAUSES[cause] ?? cause}` : ""}`;

function advice(cause, outcome) {
  const made = cause === "energy" ? outcome?.made?.[0] : null;
  const most = made ? `The line that has made the most energy is ${words(made.line)}: ${rough(made.share)} of the largest energy, at ${si(made.time, "s")}.` : "";
  return HELP[cause] || most ? h("p", {}, [HELP[cause], most].filter(Boolean).join(" ")) : "";
}

function reached({ progress, snapshots }, outcome) {
  if (!progress) return "The run had not reached its first step.";
  const { t, step } = ended(progress, outcome);
  const last = snapshots.at(-1);
  return `The run reached ${si(t, "s")} of ${si(progress.end_time, "s")}, step ${step}${last ? `; the last snapshot, of ${si(last.t, "s")}, is shown below` : ""}.`;
}
