// Card with the files of a run: names, sizes, and a download of each file.

import { call, download } from "./api.js";
import { counted, h, size } from "./figures.js";
import { fold } from "./storage.js";

const MOST = 500; // Largest number of files of a folder that are listed.

export class Files {
  constructor(run) {
    this.path = `v1/runs/${encodeURIComponent(run)}/files`;
    this.list = h("div.files", {}, h("p.hint", {}, "reading …"));
    this.note = h("p.hint", { role: "status" });
    const again = h("button.quiet", { type: "button", onclick: () => this.read() }, "Read again");
    this.fold = fold("files", false, "Files", this.list, this.note, again);
    this.fold.addEventListener("toggle", () => this.fold.open && !this.known && this.read());
    this.element = h("section.card", { "aria-label": "files" }, this.fold);
    this.fold.append(h("p.hint", {}, "All of them: ", h("code", {}, `conoid get ${run}`), "; a report in one file: ", h("code", {}, `conoid report ${run}`)));
    if (this.fold.open) this.read();
  }

  // Reads the list of files of the run, [{ path, size }]; null while unknown. The list stays unchanged if the server
  // does not answer.
  async read() {
    try {
      const { files } = await call(this.path);
      this.known = files;
      this.list.replaceChildren(...this.rows(files));
      this.note.textContent = `${counted(files.length, "file")}, ${size(files.reduce((sum, file) => sum + file.size, 0))}`;
    } catch (error) {
      this.note.textContent = error.message;
    }
    return this.known ?? null;
  }

  // Returns the rows of the table: first the files in the run's folder itself, then each folder inside of it, closed.
  rows(files) {
    return grouped(files).map(([folder, inside]) => {
      const table = h("table.listing", {}, h("tbody", {}, inside.slice(0, MOST).map((file) => this.row(file, folder))));
      const more = inside.length > MOST ? h("p.hint", {}, `${counted(inside.length - MOST, "more file")}: conoid get copies all`) : "";
      if (!folder) return h("div", {}, table, more);
      return h("details", {}, h("summary", {}, `${folder}/ `, h("small", {}, `${counted(inside.length, "file")}, ${size(inside.reduce((sum, file) => sum + file.size, 0))}`)), table, more);
    });
  }

  row(file, folder) {
    const name = file.path.slice(folder ? folder.length + 1 : 0);
    const save = h("button.text", { type: "button", title: `download ${file.path}`, onclick: () => this.save(file, name, save) }, name);
    return h("tr", {}, h("td", {}, save), h("td.number", {}, size(file.size)));
  }

  async save(file, name, button) {
    button.disabled = true;
    try {
      await download(file.url.replace(/^\//, ""), name.split("/").at(-1), file.size, (there) => { this.note.textContent = `${name}: ${size(there)} of ${size(file.size)}`; });
      this.note.textContent = `${name}: downloaded, ${size(file.size)}`;
    } catch (error) {
      this.note.textContent = error.name === "AbortError" ? "" : `${name}: ${error.message}`;
    }
    button.disabled = false;
  }
}

// Returns [[folder, files]] by the first part of the paths; "" stands for the run's folder itself, which is first.
export function grouped(files) {
  const folders = new Map([["", []]]);
  for (const file of files) {
    const at = file.path.indexOf("/");
    const folder = at < 0 ? "" : file.path.slice(0, at);
    if (!folders.has(folder)) folders.set(folder, []);
    folders.get(folder).push(file);
  }
  return [...folders].filter(([, inside]) => inside.length);
}
