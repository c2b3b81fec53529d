// Conversion of a case from JSON, as Python and the command line send it, to TOML for the editor, with one key in each
// line.

const WIDE = 100; // Largest number of characters of a table, or of a list of tables, that is written in one line.
const BARE = /^[\w-]+$/;
const DIGITS = /\d{16}/; // JavaScript rounds numbers with 16 or more digits.

// Returns the text as TOML if it is a JSON object, any other text unchanged. A case that TOML cannot express stays
// JSON.
export function asToml(text) {
  if (!text.trimStart().startsWith("{") || DIGITS.test(text)) return text;
  try {
    return `${lines(JSON.parse(text), []).join("\n").trim()}\n`;
  } catch {
    return text;
  }
}

const isTable = (value) => typeof value === "object" && !Array.isArray(value);
const areTables = (value) => Array.isArray(value) && value.length > 0 && value.every((one) => one !== null && isTable(one));
const name = (key) => (BARE.test(key) ? key : JSON.stringify(key));

// Returns a value in one line. Throws Error for null, which TOML lacks.
function inline(value) {
  if (value === null) throw new Error("TOML has no null");
  if (Array.isArray(value)) return `[${value.map(inline).join(", ")}]`;
  if (isTable(value)) return Object.keys(value).length ? `{ ${Object.entries(value).map(([key, one]) => `${name(key)} = ${inline(one)}`).join(", ")} }` : "{}";
  return JSON.stringify(value);
}

// A table has a section of its own if it is long or contains tables, or if it is at the top level of the case.
const hasSection = (value, path) =>
  (isTable(value) ? !path.length || inline(value).length > WIDE || Object.values(value).some((one) => isTable(one) || areTables(one)) : areTables(value) && (!path.length || inline(value).length > WIDE));

function lines(table, path) {
  const entries = Object.entries(table);
  for (const [, value] of entries) inline(value);
  const short = entries.filter(([, value]) => !hasSection(value, path)).map(([key, value]) => `${name(key)} = ${inline(value)}`);
  return [...short, ...entries.filter(([, value]) => hasSection(value, path)).flatMap(([key, value]) => section([...path, name(key)], value))];
}

function section(path, value) {
  const at = path.join(".");
  if (areTables(value)) return value.flatMap((one) => ["", `[[${at}]]`, ...lines(one, path)]);
  const inner = lines(value, path);
  return inner[0] === "" ? inner : ["", `[${at}]`, ...inner];
}
