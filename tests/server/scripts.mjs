// Asks modules of the page: { module, script, data } in JSON on standard input, what comes out on standard output.
// `module` may name several, with spaces between, of one folder.
// Data with "base64" is handed over as bytes.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { module, script, data } = JSON.parse(readFileSync(0, "utf8"));
const [first, ...others] = module.split(" ").map((name, i, all) => new URL(name, pathToFileURL(all[0])));
const found = { ...await import(first) };
for (const other of others) Object.assign(found, await import(other));
const bytes = data?.base64 ? new Uint8Array(Buffer.from(data.base64, "base64")).buffer : data;
const answer = new Function("page", "data", `return (${script});`)(found, bytes);
const told = (_, value) => (typeof value === "bigint" ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value, Number) : value);
process.stdout.write(JSON.stringify(answer ?? null, told));
