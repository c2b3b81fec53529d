// Head of the page of a run: title, state, connection, actions, progress.

import { duration, h, meter, percent, pill } from "./figures.js";
import { FINAL } from "./live.js";

const BRIEF = 9; // Number of characters of the id that are shown.
const OLD = 5; // Time in s without a message or an answer after which the age of the shown numbers is displayed.

export class Headline {
  // `ask(verb)` requests a checkpoint, a snapshot or a cancellation.
  constructor(run, ask) {
    this.title = h("h1");
    this.sub = h("div.sub");
    this.link = h("span.link", { role: "status" });
    this.state = h("span");
    this.message = h("p.message", { hidden: "" });
    this.progress = h("div.progress");
    this.buttons = ["checkpoint", "snapshot", "cancel"].map((verb) =>
      h(verb === "cancel" ? "button.stop" : "button.quiet", { type: "button", "data-verb": verb, onclick: () => ask(verb) }, verb[0].toUpperCase() + verb.slice(1)));
    this.report = h("button.quiet", { type: "button", hidden: "", title: "the whole run in one HTML file, made by the server", onclick: () => ask("report") }, "Report");
    this.again = h("a.button", { href: `#/new?from=${encodeURIComponent(run)}` }, "Open the case");
    this.element = h("header.head", {},
      h("div.run-head", {}, h("div.titles", {}, this.title, this.sub), h("div.side", {}, this.link, this.state, this.buttons, this.report, this.again)),
      this.progress, this.message);
  }

  // Draws the head. `connection` is [kind, words]; `busy` has the names of the requests in progress.
  draw(live, info, { connection: [kind, words], state, notice, busy }) {
    const over = FINAL.has(state);
    const old = !over && live.age > OLD ? `numbers ${duration(live.age)} old` : "";
    say(this.title, info.title || info.name || live.run);
    say(this.sub, [info.name !== info.title && info.name, live.run.slice(0, BRIEF)].filter(Boolean).join(" · "));
    this.sub.title = live.run;
    say(this.link, over ? "" : [words, old].filter(Boolean).join(", "));
    this.link.hidden = over;
    this.link.className = `link ${kind || "over"}`;
    if (this.shown !== state) this.state.replaceChildren((this.shown = state) ? pill(state) : "");
    this.progress.hidden = state === "succeeded";
    this.progress.replaceChildren(...(live.state ? [meter(state, live.fraction), h("b", {}, percent(live.fraction))] : []));
    const text = [!over && live.message, live.state === "queued" && info.reason, notice].filter(Boolean).join(" · ");
    say(this.message, text);
    this.message.hidden = !text;
    this.report.hidden = !over;
    this.report.disabled = busy.has("report");
    for (const button of this.buttons) {
      button.hidden = !state || over || (button.dataset.verb !== "cancel" && state !== "running");
      button.disabled = kind !== "live" || busy.has(button.dataset.verb);
    }
  }
}

// Sets the text of an element only if it has changed, because setting it would clear a selection.
function say(element, text) {
  if (element.printed !== text) element.textContent = element.printed = text;
}
