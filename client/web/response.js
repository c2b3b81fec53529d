// A result of a sweep over what was changed: a curve over one key, or a matrix of two. No element is made here.

import { FINAL } from "./live.js";

// A run that has not come to its end has measured something else than the others.
const measured = (row, result) => (row.state === "succeeded" ? result.value(row) : null);
const number = (value) => typeof value === "number" && Number.isFinite(value);

// The values of a column that points have, in order: numbers by size, words as they come.
export function levels(points, column) {
  const found = [...new Map(points.map(({ row }) => [column.text(row), column.value(row)]))];
  const numbers = found.every(([, value]) => number(value));
  return (numbers ? found.sort(([, a], [, b]) => a - b) : found).map(([text, value]) => ({ text, value }));
}

// The keys that vary, each with those that go together with it: each value of one belongs to one value of the other. The
// first of them stands for all; `named` says how many more there are. Where no key varies, the first one is the axis.
export function together(points, keys) {
  const course = (key) => {
    const texts = points.map(({ row }) => key.text(row));
    const order = [...new Set(texts)];
    return texts.map((text) => order.indexOf(text)).join();
  };
  const groups = new Map();
  const varying = keys.filter((key) => new Set(points.map(({ row }) => key.text(row))).size > 1);
  for (const key of varying.length ? varying : keys.slice(0, 1)) groups.set(course(key), [...(groups.get(course(key)) ?? []), key]);
  return [...groups.values()].map(([first, ...more]) => {
    const also = more.length ? ` and ${more.length} more that ${more.length > 1 ? "go" : "goes"} with it` : "";
    return { ...first, members: [first, ...more], named: `${first.title}${also}`, full: `${first.full ?? first.title}${also}` };
  });
}

// { words, curves: [{ name, data: [[x, y, id]] }] } of a result over the column `x`, both in SI units, a curve for each
// combination of the `others`; `at(row)` is its place on the axis; `words` names the places on the axis where the values of `x` are no numbers.
export function curves(points, x, others, result) {
  const places = levels(points, x);
  const words = places.every(({ value }) => number(value)) ? null : places.map(({ text }) => text);
  const at = (row) => (words ? words.indexOf(x.text(row)) : x.value(row));
  const found = new Map();
  for (const { row } of points) {
    const y = measured(row, result);
    const name = others.map((one) => `${one.title} ${one.text(row)}${one.unit ? ` ${one.unit}` : ""}`).join(", ");
    if (!found.has(name)) found.set(name, []);
    if (number(y)) found.get(name).push([at(row), y, row.id]);
  }
  return { words, curves: [...found].map(([name, data]) => ({ name, data: data.sort((a, b) => a[0] - b[0]) })), at };
}

// [[x, y, id, why]] of the points whose run has ended without a result, at the foot of the curves.
export function lost(points, { curves: found, at }) {
  const foot = Math.min(...found.flatMap(({ data }) => data.map(([, y]) => y)));
  const over = points.filter(({ row }) => FINAL.has(row.state) && row.state !== "succeeded" && at(row) !== null);
  return over.map(({ row }) => [at(row), Number.isFinite(foot) ? foot : 0, row.id, `${row.state.replaceAll("_", " ")}${row.message ? `: ${row.message}` : ""}`]);
}

// { rows, columns, cells } of two keys; cells[i][j] has the points there and the mean of their results as a share of the
// range of all, null where none of them has one.
export function matrix(points, down, across, result) {
  const [rows, columns] = [levels(points, down), levels(points, across)];
  const all = points.map(({ row }) => measured(row, result)).filter(number);
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const cells = rows.map((one) => columns.map((other) => {
    const here = points.filter(({ row }) => down.text(row) === one.text && across.text(row) === other.text);
    const values = here.map(({ row }) => measured(row, result)).filter(number);
    const mean = values.length ? values.reduce((sum, value) => sum + value, 0) / values.length : null;
    return { points: here, value: mean, share: mean === null ? null : high > low ? (mean - low) / (high - low) : 0.5 };
  }));
  return { rows, columns, cells };
}

const TELLING = [/residual_velocity/, /penetration/, /^result:probe\.[^.]*$/, /^result:reference\.(?!worst_residual)/, /^result:fragments$/, /^result:energy\.kinetic$/];

// The result that tells most: one that differs between the points, in the order of TELLING.
export function telling(points, results) {
  const differs = (column) => new Set(points.map(({ row }) => measured(row, column)).filter(number)).size > 1;
  const there = results.filter(differs);
  for (const kind of TELLING) {
    const found = there.find(({ id }) => kind.test(id));
    if (found) return found;
  }
  return there[0] ?? results[0];
}
