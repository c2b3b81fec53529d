// Asks modules of the page: { module, call, data } in JSON on standard input, what comes out on standard output.
// Data with "base64" is handed over as bytes.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { module, script, data } = JSON.parse(readFileSync(0, "utf8"));
const found = await import(pathToFileURL(module));
const bytes = data?.base64 ? new Uint8Array(Buffer.from(data.base64, "base64")).buffer : data;
const answer = new Function("page", "data", `return (${script});`)(found, bytes);
const told = (_, value) => (typeof value === "bigint" ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value, Number) : value);
process.stdout.write(JSON.stringify(answer ?? null, told));
