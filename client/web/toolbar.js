// Controls above the table of runs: filter, groups, order, columns, and actions on the marked runs.

import { count, h, words } from "./figures.js";
import { recall, remember } from "./storage.js";

const DAYS = [["", "any time"], ["1", "last day"], ["7", "last 7 days"], ["30", "last 30 days"]];
const GROUPS = [["", "no groups"], ["sweep", "by sweep"], ["case", "by case"]];
const TYPING = 80; // Time in ms without a key press after which the table is filtered.

export class Toolbar {
  // `kept`: { text, state, days, marked }, which the controls change. `on`: callbacks { change(), sort(words),
  // compare(), unmark() }.
  constructor(kept, on) {
    Object.assign(this, { kept, on });
    const change = (name) => ({ target }) => {
      kept[name] = target.value;
      on.change();
    };
    this.search = h("input.search", { type: "search", "aria-label": "filter runs", placeholder: "Filter: words, state:failed, speed_end>12", value: kept.text, autocomplete: "off", spellcheck: "false" });
    this.search.addEventListener("input", () => this.type());
    this.state = h("select", { "aria-label": "state", onchange: change("state") });
    this.days = h("select", { "aria-label": "submitted", onchange: change("days") });
    this.group = h("select", { "aria-label": "groups", onchange: ({ target }) => { remember("runs.group", target.value); on.change(); } });
    this.order = h("select.order", { "aria-label": "sort by", onchange: ({ target }) => on.sort(target.value) });
    this.compare = h("button", { type: "button", disabled: "", onclick: on.compare }, "Compare");
    this.unmark = h("button.quiet", { type: "button", hidden: "", onclick: on.unmark }, "Unmark");
    fill(this.days, DAYS, kept.days);
    fill(this.group, GROUPS, recall("runs.group", ""));
    this.element = h("div.tools-row", {}, this.search, this.state, this.days, this.group, this.order, this.chooser(), h("span.grow"), this.unmark, this.compare);
  }

  chooser() {
    const summary = h("summary", {}, "Columns");
    const element = h("details.chooser", {}, summary, this.choices = h("div.choices"));
    element.addEventListener("keydown", ({ key }) => {
      if (key !== "Escape") return;
      element.open = false;
      summary.focus();
    });
    return element;
  }

  close() { clearTimeout(this.typed); }

  type() {
    clearTimeout(this.typed);
    this.typed = setTimeout(() => {
      this.kept.text = this.search.value;
      this.on.change();
    }, TYPING);
  }

  // Clears all filters.
  reset() {
    this.search.value = this.kept.text;
    this.days.value = this.kept.days;
    this.search.focus();
  }

  // Draws the controls. `rows`: all rows; `choice`: columns that the user has selected or hidden.
  draw({ columns, choice, sort, rows }) {
    const states = new Map();
    for (const { state } of rows) states.set(state, (states.get(state) ?? 0) + 1);
    fill(this.state, [["", "any state"], ...[...states].map(([state, n]) => [state, `${words(state)} (${count(n)})`])], this.kept.state);
    fill(this.order, columns.flatMap(({ id, title }) => [[`${id} up`, `${title} ↑`], [`${id} down`, `${title} ↓`]]), `${sort.id} ${sort.down ? "down" : "up"}`);
    this.drawChoices(columns, choice);
    const marked = this.kept.marked.size;
    this.compare.disabled = marked < 2;
    this.compare.textContent = marked > 1 ? `Compare ${count(marked)}` : "Compare";
    this.compare.title = marked > 1 ? "" : "mark two runs or more";
    this.unmark.hidden = !marked;
  }

  drawChoices(columns, choice) {
    const stamp = JSON.stringify([choice, columns.map(({ id, title, shown }) => [id, title, shown])]);
    if (stamp === this.stamp) return;
    this.stamp = stamp;
    const focus = document.activeElement?.dataset?.choice;
    const box = ({ id, title, full, shown }) => h("label", { title: full ?? title }, h("input", {
      type: "checkbox", "data-choice": id, checked: (choice[id] ?? shown) && "", onchange: ({ target }) => this.choose(id, target.checked, shown) }), title);
    const groups = [...new Set(columns.map(({ group }) => group))];
    this.choices.replaceChildren(h("button.quiet", { type: "button", onclick: () => { remember("runs.columns", {}); this.on.change(); } }, "As at first"),
      ...groups.map((group) => h("fieldset", {}, h("legend", {}, group), columns.filter((one) => one.group === group && one.id !== "run").map(box))));
    if (focus) this.choices.querySelector(`[data-choice="${CSS.escape(focus)}"]`)?.focus();
  }

  choose(id, on, asIs) {
    const { [id]: _, ...others } = recall("runs.columns", {});
    remember("runs.columns", on === asIs ? others : { ...others, [id]: on });
    this.on.change();
  }
}

// Sets the options of a list only after a change, because setting them would close an open list. An unknown value
// selects the first option.
export function fill(element, choices, value) {
  const stamp = JSON.stringify(choices);
  if (element.stamp !== stamp) element.replaceChildren(...choices.map(([name, shown]) => h("option", { value: name }, shown)));
  element.stamp = stamp;
  element.value = choices.some(([name]) => name === value) ? value : choices[0]?.[0] ?? "";
}
