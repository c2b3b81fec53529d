// Response of a sweep: a result over the changed key as a curve, or a matrix over two keys. The module creates no
// elements.

import { FINAL } from "./live.js";

// A run without success has no response, because its results belong to an earlier time than those of other runs.
const measured = (row, result) => (row.state === "succeeded" ? result.value(row) : null);
const number = (value) => typeof value === "number" && Number.isFinite(value);

// Returns the different values of a column in the points, numbers sorted by size, words by occurrence.
export function levels(points, column) {
  const found = [...new Map(points.map(({ row }) => [column.text(row), column.value(row)]))];
  const numbers = found.every(([, value]) => number(value));
  return (numbers ? found.sort(([, a], [, b]) => a - b) : found).map(([text, value]) => ({ text, value }));
}

// Returns the keys that vary, grouped with keys that change together: each value of one key belongs to one value of the
// others. The first key stands for its group; `named` contains the name or the number of the other keys. If no key
// varies, the first key is the axis.
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
    const name = ({ title, full }) => full ?? title;
    const also = (of) => (more.length > 1 ? ` and ${more.length} more that go with it` : more.length ? ` and ${of(more[0])}` : "");
    return { ...first, members: [first, ...more], named: `${first.title}${also(({ title }) => title)}`, full: `${name(first)}${also(name)}` };
  });
}

// Returns { words, curves: [{ name, data: [[x, y, id]] }] } of a result over the column `x`, both in SI units, with a
// curve for each combination of the `others`. `at(row)` is the position of a row on the axis. `words` are the labels of
// the axis if the values of `x` are not numbers.
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

// Returns [[x, y, id, why]] for the points whose run has ended without a result, at the lower end of the curves.
export function lost(points, { curves: found, at }) {
  const foot = Math.min(...found.flatMap(({ data }) => data.map(([, y]) => y)));
  const over = points.filter(({ row }) => FINAL.has(row.state) && row.state !== "succeeded" && at(row) !== null);
  return over.map(({ row }) => [at(row), Number.isFinite(foot) ? foot : 0, row.id, `${row.state.replaceAll("_", " ")}${row.message ? `: ${row.message}` : ""}`]);
}

// Returns { rows, columns, cells } over two keys. cells[i][j] has the points at this position and the mean of their
// results relative to the range of all results; null without results.
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

const INFORMATIVE = [/residual_velocity/, /penetration/, /^result:probe\.[^.]*$/, /^result:reference\.(?!worst_residual)/, /^result:fragments$/, /^result:energy\.kinetic$/];

// Returns the most informative result: the first kind of INFORMATIVE whose values differ between the points.
export function telling(points, results) {
  const differs = (column) => new Set(points.map(({ row }) => measured(row, column)).filter(number)).size > 1;
  const there = results.filter(differs);
  for (const kind of INFORMATIVE) {
    const found = there.find(({ id }) => kind.test(id));
    if (found) return found;
  }
  return there[0] ?? results[0];
}
