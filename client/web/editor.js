// Text editor with line numbers; lines with a problem are marked.

import { h } from "./figures.js";

export class Editor {
  constructor(label, onInput) {
    this.numbers = h("pre.numbers", { "aria-hidden": "true" });
    this.area = h("textarea.text", { "aria-label": label, spellcheck: "false", autocapitalize: "off", autocomplete: "off", wrap: "off",
      oninput: () => this.changed(onInput), onscroll: () => { this.numbers.scrollTop = this.area.scrollTop; } });
    this.marks = new Set();
    this.element = h("div.editor", {}, this.numbers, this.area);
    this.count();
  }

  get text() { return this.area.value; }

  // Sets the text, and keeps the caret on its line if the text around it has changed.
  set text(text) {
    if (this.area.value === text) return;
    const { selectionStart: at, scrollTop } = this.area;
    const after = this.area.value.length - at;
    const before = this.area.value.slice(0, at);
    this.area.value = text;
    this.area.setSelectionRange(...Array(2).fill(text.startsWith(before) ? at : Math.max(0, text.length - after)));
    this.area.scrollTop = scrollTop;
    this.count();
  }

  changed(onInput) {
    this.count();
    onInput();
  }

  // Marks the lines with the given numbers, from 0.
  mark(lines) {
    this.marks = new Set(lines);
    this.drawn = 0;
    this.count();
  }

  count() {
    const lines = this.area.value.split("\n").length;
    if (lines === this.drawn) return;
    this.drawn = lines;
    this.numbers.replaceChildren(...Array.from({ length: lines }, (_, i) => h(this.marks.has(i) ? "span.wrong" : "span", {}, `${i + 1}\n`)));
  }

  // Selects a line and scrolls it into view.
  goTo(line) {
    const lines = this.area.value.split("\n");
    const start = lines.slice(0, line).reduce((sum, one) => sum + one.length + 1, 0);
    this.area.focus();
    this.area.setSelectionRange(start, start + (lines[line]?.length ?? 0));
    this.area.scrollTop = Math.max(0, (this.area.scrollHeight * (line - 4)) / lines.length);
  }
}
