// Which page is shown, and the form to sign in.

import { Problem, call, token } from "./api.js";
import { h } from "./figures.js";
import { offer } from "./libraries.js";
import { PairPage } from "./pair.js";
import { place } from "./place.js";
import { RunPage } from "./run.js";
import { RunsPage } from "./runs.js";

const page = document.getElementById("page");
const who = document.getElementById("who");
const leave = document.getElementById("leave");
let shown = null;

function show(next) {
  shown?.close?.();
  shown = next;
  page.replaceChildren(next.element);
}

// Sign in --------------------------------------------------------------------------------------------------------------

function signIn(told = "") {
  who.textContent = "";
  leave.hidden = true;
  const field = h("input", { type: "password", autocomplete: "off", "aria-label": "token", placeholder: "token", required: "" });
  const submit = async (event) => {
    event.preventDefault();
    token.set(field.value.trim());
    await start();
  };
  const form = h("form.card.sign-in", { onsubmit: submit },
    h("h1", {}, "Sign in"),
    h("p.hint", {}, "Paste the token that the server gave you. It is kept in this tab only, and forgotten when you close it."),
    field,
    told ? h("p.problem", {}, told) : "",
    h("div", {}, h("button", {}, "Sign in")));
  show({ element: form });
  field.focus();
}

// Where we are ---------------------------------------------------------------------------------------------------------

const PAGES = {
  runs: () => new RunsPage(() => signIn("The server does not accept this token any more.")),
  run: ([run]) => new RunPage(run),
  compare: (runs) => new PairPage(runs),
};

function route() {
  const { page: name, names } = place(location.hash);
  show((PAGES[name] ?? PAGES.runs)(names));
}

// A server with tokens is not asked before there is one.
async function start() {
  try {
    const { auth } = await offer();
    if (auth && !token.get()) return signIn();
    const me = await call("v1/me");
    who.textContent = me.owner;
    leave.hidden = !token.get();
    route();
  } catch (error) {
    const known = error instanceof Problem && (error.status === 401 || error.status === 403);
    if (known) signIn(token.get() ? "The server does not know this token." : "");
    else page.replaceChildren(h("p.problem", {}, `No answer from the server: ${error.message}`));
    if (known) token.clear();
  }
}

leave.addEventListener("click", () => {
  token.clear();
  signIn();
});
addEventListener("hashchange", () => (shown?.element?.matches?.("form") ? start() : route()));
start();
