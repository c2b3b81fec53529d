// Loading of three.js and ECharts from the server; each library is loaded once, at its first use.

import { Unanswered } from "./away.js";

const known = {};

// Returns the result of `read`, which is called once; after a failure it is called again.
const once = (name, read) => (known[name] ??= read().catch((error) => {
  delete known[name];
  throw error;
}));

// Returns { auth, problem, three, echarts }, the libraries of the server. The request needs no token.
export const offer = () => once("offer", () => fetch(new URL("lib/index.json", document.baseURI)).catch(() => {
  throw new Unanswered();
}).then((answer) => answer.json()));

async function library(name) {
  const { [name]: place, problem } = await offer();
  if (!place) throw new Error(problem || "the server has no libraries for the page");
  return import(new URL(place, document.baseURI));
}

export const three = () => once("three", () => library("three"));
export const echarts = () => once("echarts", () => library("echarts").then((module) => module.echarts));
