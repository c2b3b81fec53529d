// three.js and ECharts, out of the package that the server has found; each is loaded when it is needed, once.

const known = {};

// What `read` gives, read once; again where that has failed: the server may be back.
const once = (name, read) => (known[name] ??= read().catch((error) => {
  delete known[name];
  throw error;
}));

// { auth, problem, three, echarts }: what the server has. It needs no token.
export const offer = () => once("offer", () => fetch(new URL("lib/index.json", document.baseURI)).then((answer) => answer.json()));

async function library(name) {
  const { [name]: place, problem } = await offer();
  if (!place) throw new Error(problem || "the server has no libraries for the page");
  return import(new URL(place, document.baseURI));
}

export const three = () => once("three", () => library("three"));
export const echarts = () => once("echarts", () => library("echarts").then((module) => module.echarts));
