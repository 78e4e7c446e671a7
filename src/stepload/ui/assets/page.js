// The page: one view at a time, named by the part of the address behind #.

import {h, keepToken, Refused} from "./tools.js";
import {compareView, runsView} from "./runs.js";
import {planView} from "./plan.js";
import {runView} from "./run.js";

const VIEWS = {runs: runsView, compare: compareView, plan: planView, run: runView};
const place = document.getElementById("view");
let leave = () => {};

async function show() {
  const [, name = "runs", ...words] = location.hash.split("/");
  leave();
  leave = () => {};
  place.replaceChildren();
  for (const link of document.querySelectorAll("nav a")) {
    const here = link.hash === `#/${name}` || (name === "run" && link.hash === "#/runs");
    if (here) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  try {
    const ends = (VIEWS[name] ?? runsView)(place, words.map(decodeURIComponent));
    leave = ends ?? leave;
  } catch (error) {
    place.replaceChildren(h("p", {className: "banner bad", role: "alert"}, error.message));
  }
}

window.addEventListener("unhandledrejection", event => {
  if (!(event.reason instanceof Refused)) return;
  event.preventDefault();
  place.prepend(h("p", {className: "banner bad", role: "alert"}, event.reason.message));
});
document.getElementById("skip").addEventListener("click", event => {
  event.preventDefault();
  place.focus();
});
const given = location.hash.match(/^#token=(.+)$/);
if (given) {
  keepToken(decodeURIComponent(given[1]));
  history.replaceState(null, "", "#/runs");
}
window.addEventListener("hashchange", show);
show();
