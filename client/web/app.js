// Router of the page, and form for signing in.

import { Problem, call, token } from "./api.js";
import { unanswered } from "./away.js";
import { h } from "./figures.js";
import { offer } from "./libraries.js";
import { ComparePage } from "./compare.js";
import { NewPage } from "./new.js";
import { addressOf, place } from "./address.js";
import { RunPage } from "./run.js";
import { RunsPage } from "./runs.js";
import { SweepPage } from "./sweep.js";
import { isShort, wholeNames } from "./shortids.js";

const page = document.getElementById("page");
const who = document.getElementById("who");
const pages = document.getElementById("pages");
const leave = document.getElementById("leave");
const AWAY = 3000; // Time in ms after which a request is repeated if the server does not answer.
let shown = null;
let again = 0;

function show(next) {
  shown?.close?.();
  shown = next;
  page.replaceChildren(next.element);
}

// Sign in --------------------------------------------------------------------------------------------------------------

function signIn(reason = "") {
  who.textContent = "";
  leave.hidden = true;
  const field = h("input#token", { type: "password", autocomplete: "current-password", "aria-label": "token", placeholder: "token", required: "" });
  const remembered = h("input", { type: "checkbox" });
  const submit = async (event) => {
    event.preventDefault();
    token.set(field.value.trim(), remembered.checked);
    await start();
  };
  const form = h("form.card.sign-in", { onsubmit: submit },
    h("h1", {}, "Sign in"),
    h("p.hint", {}, "Paste the token that the server gave you. This tab keeps it until you close it."),
    field,
    h("label.check", {}, remembered, h("span", {}, "Remember the token in this browser until I sign out")),
    reason ? h("p.problem", { role: "alert" }, reason) : "",
    h("div", {}, h("button", {}, "Sign in")));
  show({ element: form, signsIn: true });
  field.focus();
}

// Router ---------------------------------------------------------------------------------------------------------------

const refuse = () => {
  token.clear();
  signIn("The server does not accept this token any more.");
};
const PAGES = {
  runs: () => new RunsPage(refuse),
  run: ([run]) => new RunPage(run, refuse),
  sweep: ([sweep]) => new SweepPage(sweep, refuse),
  compare: (runs) => new ComparePage(runs),
  new: (_, query) => new NewPage(query, refuse),
};

// Replaces a short id in the address by the complete id.
async function route() {
  clearTimeout(again);
  const { page: name, names, query } = place(location.hash);
  if (names.some(isShort)) {
    const here = location.hash;
    const found = await wholeNames(name, names).catch((error) => {
      if (location.hash === here) away(error);
    });
    if (!found || location.hash !== here) return;
    if (found.join() !== names.join()) {
      location.replace(addressOf(name, found));
      return;
    }
  }
  for (const link of pages.children) link.ariaCurrent = place(link.hash).page === name ? "page" : null;
  show((PAGES[name] ?? PAGES.runs)(names, query));
}

function away(error) {
  show({ element: h("section.card.missing", {}, h("h1", {}, "The server does not answer"), h("p.problem", { role: "status" }, unanswered(error, "", AWAY)),
    h("p.hint", {}, "The page opens as soon as the server answers. The runs go on without the server; ", h("code", {}, "conoid show FOLDER"), " reads the folder of a run.")) });
  again = setTimeout(start, AWAY);
}

// A server that requires tokens gets no request before the page has a token. If the server does not answer, the request
// is repeated.
async function start() {
  clearTimeout(again);
  try {
    const asked = token.get() ? call("v1/me") : null;
    const [{ auth }, known] = await Promise.all([offer(), asked]);
    if (auth && !token.get()) return signIn();
    const me = known ?? await call("v1/me");
    who.textContent = me.owner;
    leave.hidden = !token.get();
    route();
  } catch (error) {
    if (error instanceof Problem && (error.status === 401 || error.status === 403)) {
      const reason = token.get() ? "This token is not valid on the server." : "";
      token.clear();
      return signIn(reason);
    }
    away(error);
  }
  return undefined;
}

leave.addEventListener("click", () => {
  token.clear();
  signIn();
});
// Called when another tab has stored or removed the token.
token.listen((text) => {
  if (text && shown?.signsIn) start();
  else if (!text) {
    token.clear();
    signIn();
  }
});
addEventListener("hashchange", () => (shown?.signsIn ? start() : route()));
start();
