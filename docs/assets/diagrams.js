// Draws the mermaid diagrams of the site, again after a change between light and dark colours; without JavaScript they stay text.
import { mermaid } from "./mermaid/index.js";

const diagrams = [...document.querySelectorAll("pre.diagram")].map((place) => ({ place, text: place.textContent }));

async function draw() {
  const dark = document.body.dataset.mdColorScheme === "slate";
  mermaid.initialize({ startOnLoad: false, theme: dark ? "dark" : "neutral", fontFamily: getComputedStyle(document.body).fontFamily, sequence: { actorMargin: 20, width: 130 } });
  for (const [number, { place, text }] of diagrams.entries()) {
    const { svg } = await mermaid.render(`diagram${number}`, text);
    place.innerHTML = svg;
  }
}

if (diagrams.length) {
  await draw();
  new MutationObserver(draw).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });
}
