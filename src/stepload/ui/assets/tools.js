// What all views use: elements, requests to the server, the token.

/** An element; text is never HTML. Keys that begin with "on" are listeners. */
export function h(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (key in made && key !== "list") made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children.flat().filter(each => each !== null && each !== undefined && each !== ""));
  return made;
}

export class Refused extends Error {}

export const lost = is => { document.getElementById("lost").hidden = !is; };

async function answer(path, options) {
  let response;
  try {
    response = await fetch(path, options);
  } catch (error) {
    if (error.name !== "AbortError") lost(true);
    throw error;
  }
  lost(false);
  const told = await response.json();
  if (!response.ok) throw new Refused([told.error, told.hint].filter(Boolean).join(". "));
  return told;
}

export const get = (path, query = {}) => answer(`/api/${path}?${new URLSearchParams(query)}`);

export const post = (path, name, text, signal) => answer(`/api/${path}`, {
  method: "POST", signal, body: JSON.stringify({name, text}),
  headers: {"Content-Type": "application/json", ...(token() ? {"X-Stepload-Token": token()} : {})},
});

const KEY = "stepload-token";
export const token = () => sessionStorage.getItem(KEY) ?? "";
export const keepToken = text => sessionStorage.setItem(KEY, text.trim());

export const MOODS = {identified: "good", "system stiffness": "good", go: "good", warn: "doubt", marginal: "doubt", refused: "bad"};

/** A word of a verdict in its colour. */
export const verdict = word => h("span", {className: `word ${MOODS[word.replaceAll("_", " ")] ?? (word ? "bad" : "")}`},
  word.replaceAll("_", " "));

export const when = row => row.started.slice(0, 16).replace("T", " ");
export const nameOf = row => [row.payload, row.specimen].filter(Boolean).join(" · ") || row.run_id || row.key;
export const runLink = (row, text) => h("a", {href: `#/run/${encodeURIComponent(row.key)}`}, text ?? nameOf(row));
export const NO_RUN = "stepload run PLAN.yaml --dry-run";

/** Calls `look` now and then again after each `period`, while the page is visible; returns what ends it. */
export function repeatedly(look, period) {
  let timer = 0, over = false;
  const again = async () => {
    try {
      if (!document.hidden) await look();
    } catch { /* said at the top of the page */ }
    if (!over) timer = setTimeout(again, period);
  };
  again();
  return () => {
    over = true;
    clearTimeout(timer);
  };
}
