// three.js and ECharts, out of the package that the server has found; each is loaded when it is needed, once.

let asked = null;
const loaded = {};

// { auth, problem, three, echarts }: what the server has. It needs no token.
export const offer = () => (asked ??= fetch(new URL("lib/index.json", document.baseURI)).then((answer) => answer.json()));

async function library(name) {
  const { [name]: place, problem } = await offer();
  if (!place) throw new Error(problem || "the server has no libraries for the page");
  return import(new URL(place, document.baseURI));
}

export const three = () => (loaded.three ??= library("three"));
export const echarts = () => (loaded.echarts ??= library("echarts").then((module) => module.echarts));
