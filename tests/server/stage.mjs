// A page without a browser has elements that store their children, and a server with answers from the test. The
// standard input is { module, script } in JSON; the result of the async script is written to standard output. The
// script can use `load(module)`, `text(element)`, `pause(ms)`, `store()` and `state.served`. The function
// `state.served` gets a path and returns the data of a JSON answer, or a number, which is the status of an answer. If
// `state.served` throws, the server does not answer.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

class Element {
  constructor(tag) { Object.assign(this, { tag, children: [], style: {}, dataset: {}, options: [], classList: { add() {} }, hidden: false, value: "" }); }
  append(...children) { for (const child of children) this.insertBefore(child); }
  prepend(child) { this.insertBefore(child, this.children[0]); }
  insertBefore(child, next) {
    if (child instanceof Element) {
      child.remove();
      child.parent = this;
    }
    this.children.splice(next ? this.children.indexOf(next) : this.children.length, 0, child);
  }
  remove() {
    if (this.parent) this.parent.children = this.parent.children.filter((one) => one !== this);
  }
  replaceChildren(...children) {
    this.children = [];
    this.append(...children);
  }
  setAttribute(name, value) { this[name] = value; }
  set textContent(value) { this.children = [value]; }
  querySelectorAll() { return []; }
  querySelector() { return null; }
  get childElementCount() { return this.children.length; }
  addEventListener(name, work) { this[`on${name}`] = work; }
  focus() {}
  setSelectionRange() {}
}

class Observer {
  observe() {}
  disconnect() {}
}

const known = {};
const stage = {
  document: { baseURI: "http://x/", title: "", addEventListener() {}, removeEventListener() {}, createElement: (tag) => new Element(tag), getElementById: (id) => (known[id] ??= new Element(id)), documentElement: new Element("html") },
  location: { hash: "" }, sessionStorage: { getItem: () => "token", setItem() {}, removeItem() {} }, addEventListener() {}, removeEventListener() {},
  matchMedia: () => ({ addEventListener() {}, removeEventListener() {} }), getComputedStyle: () => ({ getPropertyValue: () => "" }),
  IntersectionObserver: Observer, ResizeObserver: Observer, requestAnimationFrame: (work) => setTimeout(work),
};
Object.assign(globalThis, stage);

export const state = { served: () => { throw new Error("away"); }, asked: [] };
globalThis.fetch = async (url, options = {}) => {
  const path = new URL(url).pathname.slice(1);
  state.asked.push(path);
  const answer = state.served(path, options);
  const status = typeof answer === "number" ? answer : 200;
  return { ok: status < 300, status, headers: new Map(), json: async () => answer };
};

const text = (element) => (element instanceof Element ? element.children.map(text).join(" ") : String(element));
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const { module, script } = JSON.parse(readFileSync(0, "utf8"));
const load = (name) => import(new URL(name, pathToFileURL(module)));
// Storage that replaces the storage of a browser, by name.
const store = () => {
  const kept = new Map();
  return { kept, getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value), removeItem: (key) => kept.delete(key) };
};
const Async = (async () => {}).constructor;
const answer = await new Async("load", "state", "text", "pause", "store", script)(load, state, text, pause, store);
process.stdout.write(JSON.stringify(answer ?? null), () => process.exit(0));
