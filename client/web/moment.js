// Field with the time of the shown snapshot. The user can type a time; the nearest snapshot is shown.

import { h, si } from "./figures.js";

const UNITS = { s: 1, ms: 1e-3, us: 1e-6, "µs": 1e-6, "μs": 1e-6, ns: 1e-9 };
const FORM = /^\s*([\d.]+(?:e[+-]?\d+)?)\s*(s|ms|us|µs|μs|ns)?\s*$/i;

// Returns the time, s, of a typed text such as "20 us"; null for any other text. A number without a unit has the unit
// of the text `before`.
export function typedTime(text, before) {
  const found = FORM.exec(text);
  const value = Number(found?.[1]);
  const unit = UNITS[found?.[2]?.toLowerCase() ?? FORM.exec(before)?.[2]] ?? 1;
  return found && Number.isFinite(value) ? value * unit : null;
}

// Returns the number of the time in `times` (ascending) that is nearest to `t`.
export const nearestTo = (times, t) => times.reduce((best, time, i) => (Math.abs(time - t) < Math.abs(times[best] - t) ? i : best), 0);

export class Moment {
  // `times()` returns the times of the snapshots, s; `onChoose` is called with the number of the chosen snapshot.
  constructor(times, onChoose) {
    this.text = "";
    this.element = h("input.moment", { type: "text", size: 8, spellcheck: "false", autocomplete: "off", "aria-label": "time of the snapshot", title: "type a time, such as 20 us; the nearest snapshot is shown" });
    this.element.onfocus = () => this.element.select();
    this.element.onchange = () => {
      const t = typedTime(this.element.value, this.text);
      if (t === null) this.element.value = this.text;
      else onChoose(nearestTo(times(), t));
    };
  }

  show(t) { this.element.value = this.text = si(t, "s"); }
}
