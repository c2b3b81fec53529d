// Token of this tab, or the token that this browser has stored. Without storage the token lasts as long as the page.

const KEY = "conoid.token";
let here = "";

const at = (store, act) => {
  try {
    return act(store());
  } catch {
    return null;
  }
};
const session = () => sessionStorage;
const lasting = () => localStorage;

export const token = {
  get: () => here || (at(session, (store) => store.getItem(KEY)) ?? at(lasting, (store) => store.getItem(KEY)) ?? ""),

  // Sets the token; with `remembered` it is stored for other tabs and later visits.
  set(text, remembered = false) {
    here = text;
    at(session, (store) => store.setItem(KEY, text));
    if (remembered) at(lasting, (store) => store.setItem(KEY, text));
    else at(lasting, (store) => store.removeItem(KEY));
  },

  clear() {
    here = "";
    at(session, (store) => store.removeItem(KEY));
    at(lasting, (store) => store.removeItem(KEY));
  },

  // Calls `onChange(text)` when another tab stores a token or signs out (text "").
  listen(onChange) {
    addEventListener("storage", ({ key, newValue, storageArea }) => {
      if (key === KEY && storageArea === at(lasting, (store) => store)) onChange(newValue ?? "");
    });
  },
};
