// Program that evaluates an expression with modules of the page. The standard input is { module, script, data } in
// JSON; the value of the expression is written to standard output. The field `module` may name several modules of one
// folder, separated by spaces. Data with the key "base64" is passed to the expression as bytes.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { module, script, data } = JSON.parse(readFileSync(0, "utf8"));
const [first, ...others] = module.split(" ").map((name, i, all) => new URL(name, pathToFileURL(all[0])));
const found = { ...await import(first) };
for (const other of others) Object.assign(found, await import(other));
const bytes = data?.base64 ? new Uint8Array(Buffer.from(data.base64, "base64")).buffer : data;
const answer = new Function("page", "data", `return (${script});`)(found, bytes);
const plain = (_, value) => (typeof value === "bigint" ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value, Number) : value);
process.stdout.write(JSON.stringify(answer ?? null, plain));
