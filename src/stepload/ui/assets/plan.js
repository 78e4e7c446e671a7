// Preflight of a plan that is dropped in, opened from the folder, or written here. Nothing is saved.

import {get, h, MOODS, post} from "./tools.js";

const kept = {name: "plan.yaml", text: ""};
const WAIT_MS = 500, MOST_BYTES = 1 << 20;

export function planView(place) {
  const gutter = h("div", {className: "gutter", "aria-hidden": "true"});
  const text = h("textarea", {value: kept.text, spellcheck: false, autocapitalize: "off", "aria-label": "Plan (YAML)",
    placeholder: "Drop a plan here, open one of the folder, or write one.", oninput: () => changed(), onscroll: () => { gutter.scrollTop = text.scrollTop; }});
  const editor = h("div", {className: "editor"}, gutter, text);
  const names = h("select", {"aria-label": "Plans of the folder", onchange: () => open(names.value)}, h("option", {value: ""}, "open a plan of the folder …"));
  const file = h("input", {type: "file", accept: ".yaml,.yml", onchange: () => take(file.files[0])});
  const where = h("input", {value: kept.name, size: 26, "aria-label": "Name in the folder", oninput: () => { kept.name = where.value; changed(); }});
  const out = h("section", {className: "panel", "aria-live": "polite"});
  let timer = 0, asked = null, marks = new Map();

  function number() {
    const lines = text.value.split("\n").length;
    gutter.replaceChildren(...Array.from({length: lines}, (_, i) => h("span", {className: marks.get(i + 1) ?? ""}, String(i + 1))));
    gutter.scrollTop = text.scrollTop;
  }

  function changed() {
    kept.text = text.value;
    number();
    out.classList.add("stale");
    clearTimeout(timer);
    timer = setTimeout(check, WAIT_MS);
  }

  async function check() {
    asked?.abort();
    if (!text.value.trim()) {
      marks = new Map();
      number();
      out.classList.remove("stale");
      out.replaceChildren(h("p", {className: "empty"}, "No plan yet. These come with stepload:", h("br"), h("code", {}, "stepload plans copy plastic-sphere")));
      return;
    }
    asked = new AbortController();
    const {signal} = asked;
    try {
      show(await post("preflight", kept.name, text.value, signal));
    } catch (error) {
      if (signal.aborted) return;
      marks = new Map();
      out.replaceChildren(h("p", {className: "word bad"}, error.message));
    }
    out.classList.remove("stale");
    number();
  }

  /** A button that leads to a place of the text. */
  function link(line, column) {
    return h("button", {className: "place", type: "button", onclick: () => {
      const lines = text.value.split("\n");
      const start = lines.slice(0, line - 1).reduce((sum, each) => sum + each.length + 1, 0) + column - 1;
      text.focus();
      text.setSelectionRange(start, start + Math.max(1, (lines[line - 1] ?? "").slice(column - 1).length));
      text.scrollTop = Math.max(0, (line - 6) * 18);
    }}, `line ${line}:${column}`);
  }

  function show(told) {
    marks = new Map();
    if (told.problems.length) {
      told.problems.filter(each => each.here).forEach(each => marks.set(each.line, "bad"));
      const many = told.count === 1 ? "1 problem" : `${told.count} problems`;
      out.replaceChildren(h("h1", {}, h("span", {className: "word bad"}, "NOT READ"), ` ${many} in this plan`),
        h("ul", {className: "findings"}, told.problems.map(each => h("li", {className: "bad"},
          each.here && each.line ? link(each.line, each.column) : each.line ? h("b", {}, `${each.file}:${each.line}:${each.column}`) : "",
          h("p", {}, each.message), each.hint ? h("p", {className: "soft"}, `→ ${each.hint}`) : ""))));
      return;
    }
    const moods = {refuse: "bad", warn: "doubt", note: ""};
    const weighty = told.findings.filter(each => each.severity !== "note");
    const notes = told.findings.filter(each => each.severity === "note");
    weighty.filter(each => each.line).forEach(each => marks.set(each.line, moods[each.severity]));
    const item = each => h("li", {className: moods[each.severity]}, each.message, " ", h("span", {className: "soft small"}, each.code), each.line ? [" ", link(each.line, each.column)] : "",
      each.remedy ? h("p", {className: "soft"}, `→ ${each.remedy}`) : "");
    out.replaceChildren(
      h("h1", {}, h("span", {className: `word ${MOODS[told.verdict]}`}, told.verdict.toUpperCase())), h("p", {}, told.headline),
      weighty.length ? h("ul", {className: "findings"}, weighty.map(item)) : "",
      h("table", {className: "inner"}, h("tbody", {}, told.figures.map(([label, value, note]) =>
        h("tr", {}, h("th", {scope: "row"}, label), h("td", {className: "num"}, value), h("td", {className: "soft"}, note))))),
      notes.length ? h("details", {}, h("summary", {}, notes.length === 1 ? "1 note" : `${notes.length} notes`), h("ul", {className: "findings"}, notes.map(item))) : "");
  }

  function put(name, content) {
    kept.name = where.value = name;
    text.value = content;
    text.scrollTop = 0;
    changed();
  }

  async function open(name) {
    if (name) put(name, (await get("plan", {name})).text);
  }

  async function take(dropped) {
    if (!dropped) return;
    if (dropped.size > MOST_BYTES) out.replaceChildren(h("p", {className: "word bad"}, `${dropped.name} is larger than 1 MiB: no plan`));
    else put(dropped.name, await dropped.text());
  }

  const over = on => event => {
    event.preventDefault();
    editor.classList.toggle("over", on);
  };
  editor.addEventListener("dragover", over(true));
  editor.addEventListener("dragleave", over(false));
  editor.addEventListener("drop", event => {
    over(false)(event);
    take(event.dataTransfer.files[0]);
  });
  place.append(
    h("div", {className: "bar"}, names, h("label", {}, file, h("span", {className: "like"}, "another file …")), h("label", {className: "end"}, "Name in the folder", where)),
    h("div", {className: "plan"}, h("div", {}, editor,
      h("p", {className: "soft small"}, "Files that the plan names are found from its name in the folder, and only there. Nothing is saved.")), out));
  number();
  check();
  get("plans").then(({plans}) => names.append(...plans.map(name => h("option", {value: name}, name))));
  return () => {
    clearTimeout(timer);
    asked?.abort();
  };
}
