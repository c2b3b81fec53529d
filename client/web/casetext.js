// Positions of the keys of a case in its text (TOML or JSON), and replacement of the value of a key in the text. The
// server reads the case; this module only finds lines, and leaves the rest of the text unchanged.

const HEADER = /^\s*(\[\[?)\s*([^\]]+?)\s*\]\]?/;
const KEY = /^\s*((?:[\w-]+|"[^"\n]*"|'[^'\n]*')(?:\s*\.\s*(?:[\w-]+|"[^"\n]*"|'[^'\n]*'))*)\s*=\s*/;
// A value on one line, and the comment after the value.
const LITERAL = /^("(?:[^"\\\n]|\\.)*"|'[^'\n]*'|[^#"'\n]*?)(\s*#.*)?$/;
const OPENS = { "[": 1, "{": 1, "]": -1, "}": -1 };

// Returns [{ line, start, end }] of all statements. A statement with brackets or with a text in three quotes may span
// several lines.
export function statements(text) {
  const found = [];
  let [start, line, depth, quote] = [0, 0, 0, ""];
  const close = (end, next) => {
    if (text.slice(start, end).trim()) found.push({ line, start, end });
    [start, line, depth] = [end + 1, next, 0];
  };
  let at = 0;
  let lines = 0;
  while (at < text.length) {
    const three = text.slice(at, at + 3);
    if (text[at] === "\n") lines += 1;
    if (quote) {
      if (text[at] === "\\" && quote[0] === '"') lines += text[++at] === "\n" ? 1 : 0;
      else if (text.startsWith(quote, at)) [at, quote] = [at + quote.length - 1, ""];
      // A quoted text without an end.
      else if (quote.length === 1 && text[at] === "\n") [at, lines, quote] = [at - 1, lines - 1, ""];
    } else if (three === '"""' || three === "'''") [quote, at] = [three, at + 2];
    else if (text[at] === '"' || text[at] === "'") quote = text[at];
    else if (text[at] === "#") {
      while (at + 1 < text.length && text[at + 1] !== "\n") at += 1;
    } else if (text[at] === "\n") {
      if (depth <= 0 || HEADER.test(text.slice(start, at))) close(at, lines);
    } else depth += OPENS[text[at]] ?? 0;
    at += 1;
  }
  close(text.length, lines);
  return found;
}

const plain = (key) => key.split(/\s*\.\s*/).map((word) => word.replace(/^["']|["']$/g, "")).join(".");

// Returns [{ line, start, end, table, key, value }] of all statements. `table` is the path of the table, such as
// `parts[0].mesh`. `key` is the text before the "=", "" for a header. `value` is the position at which the value
// starts.
export function placed(text) {
  const counts = {};
  let table = "";
  const resolve = (name) => name.split(".").reduce((path, word) => {
    const next = path ? `${path}.${word}` : word;
    return next in counts ? `${next}[${counts[next]}]` : next;
  }, "");
  return statements(text).map((one) => {
    const body = text.slice(one.start, one.end);
    const header = HEADER.exec(body);
    if (header) {
      const name = plain(header[2]);
      const over = resolve(name.split(".").slice(0, -1).join("."));
      const own = over ? `${over}.${name.split(".").at(-1)}` : name;
      if (header[1] === "[[") counts[own] = (counts[own] ?? -1) + 1;
      table = own in counts ? `${own}[${counts[own]}]` : own;
      return { ...one, table, key: "" };
    }
    const key = KEY.exec(body);
    return { ...one, table, key: key ? plain(key[1]) : "", value: one.start + (key?.[0].length ?? 0) };
  });
}

// Returns a number or a text as it is written in the case; "" if the key is missing.
export function valueOf(text, table, name) {
  if (isJson(text)) return String((table ? read(text)?.[table] : read(text))?.[name] ?? "");
  const found = placed(text).find((one) => full(one) === (table ? `${table}.${name}` : name));
  const value = found ? LITERAL.exec(text.slice(found.value, found.end))?.[1] ?? "" : "";
  return value.startsWith('"') ? read(value) ?? "" : value.replace(/^'|'$/g, "").trim();
}

export const isJson = (text) => /^\s*\{/.test(text);

function read(text) {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}

// Malformed JSON stays unchanged, because the server reports the error.
function changed(text, change) {
  const data = read(text);
  if (!data) return text;
  change(data);
  return `${JSON.stringify(data, null, 2)}\n`;
}

function eachTable(value, act) {
  if (value === null || typeof value !== "object") return;
  act(value);
  for (const inner of Object.values(value)) eachTable(inner, act);
}

const full = ({ table, key }) => [table, key].filter(Boolean).join(".");

// Returns the line (from 0) of a key or of its nearest existing parent; -1 if there is none.
export function lineOf(text, key) {
  const all = placed(text).map((one) => [full(one), one.line]);
  for (let name = key; name; name = name.slice(0, Math.max(0, name.lastIndexOf("."), name.lastIndexOf("[")))) {
    const found = all.find(([one]) => one === name) ?? all.find(([one]) => one.startsWith(`${name}.`) || one.startsWith(`${name}[`));
    if (found) return found[1];
  }
  return -1;
}

// Returns the text with `name = literal` in a table of the case ("" for the top level); a missing table is added.
export function withKey(text, table, name, literal) {
  if (isJson(text)) return changed(text, (data) => { (table ? (data[table] ??= {}) : data)[name] = JSON.parse(literal); });
  const all = placed(text);
  const found = all.find((one) => full(one) === (table ? `${table}.${name}` : name));
  const spot = (at, words) => text.slice(0, at) + words + text.slice(at);
  if (found) return text.slice(0, found.value) + literal + comment(text.slice(found.value, found.end)) + text.slice(found.end);
  if (!table) return spot(0, `${name} = ${literal}\n`);
  const header = all.find((one) => one.table === table && !one.key);
  if (header) return spot(header.end, `\n${name} = ${literal}`);
  return `${text.trimEnd()}\n\n[${table}]\n${name} = ${literal}\n`;
}

// Returns the rest of a line after a number or a quoted text.
const comment = (value) => LITERAL.exec(value)?.[2] ?? "";

// Returns the text with the sha256 of a file in each table that names the file by `path`.
export function withHash(text, path, sha256) {
  if (isJson(text)) return changed(text, (data) => eachTable(data, (one) => { if (one.path === path) one.sha256 = sha256; }));
  const all = placed(text);
  const edits = all.filter(({ key }) => key).flatMap((one) => {
    if (one.key.split(".").at(-1) === "path" && reads(text, one, path)) return [beside(text, all, one, sha256)];
    return /[[{]/.test(text[one.value]) ? inside(text, one, path, sha256) : [];
  });
  return edits.sort((a, b) => b.start - a.start).reduce((made, { start, end, words }) => made.slice(0, start) + words + made.slice(end), text);
}

const literals = (path) => [JSON.stringify(path), `'${path}'`];
const reads = (text, { value, end }, path) => literals(path).some((one) => text.slice(value, end).startsWith(one));

// For `mesh.path = "…"` on a line of its own, the hash is written on the next line, or replaces an existing hash in the
// same table.
function beside(text, all, one, sha256) {
  const name = `${one.key.slice(0, -"path".length)}sha256`;
  const known = all.find(({ table, key }) => table === one.table && key === name);
  if (known) return { start: known.value, end: known.end, words: `"${sha256}"${comment(text.slice(known.value, known.end))}` };
  return { start: one.end, end: one.end, words: `\n${/^[ \t]*/.exec(text.slice(one.start, one.end))[0]}${name} = "${sha256}"` };
}

// For `{ path = "…" }`, the hash is written inside of the braces around the path, which may be nested.
function inside(text, { value, end }, path, sha256) {
  const words = literals(path).map((one) => one.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("|");
  const body = text.slice(value, end);
  return [...body.matchAll(new RegExp(`(?<=[\\s{,])((?:[\\w-]+\\s*\\.\\s*)*)path\\s*=\\s*(?:${words})`, "g"))].map((found) => {
    const [whole, prefix] = found;
    const [open, close] = [body.lastIndexOf("{", found.index), body.indexOf("}", found.index)];
    const old = /(sha256\s*=\s*)(?:"[^"]*"|'[^']*')/.exec(body.slice(open, close));
    if (old) return { start: value + open + old.index, end: value + open + old.index + old[0].length, words: `${old[1]}"${sha256}"` };
    const place = value + found.index + whole.length;
    return { start: place, end: place, words: `, ${prefix}sha256 = "${sha256}"` };
  });
}
