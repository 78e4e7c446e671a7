// The runs of the folder: a table with filter and trend, and curves of several over each other.

import {curveChart, legend, trendChart} from "./charts.js";
import {get, h, nameOf, NO_RUN, repeatedly, runLink, verdict, when} from "./tools.js";

const COLOURS = ["--c0", "--c1", "--c2", "--c3", "--c4", "--c5", "--c6", "--c7"];
const ticked = new Set();
const filter = {text: "", simulated: true, payload: ""};
const kept = {seen: "", runs: []};

/** The rows of all runs, the newest first; true where they differ from before. */
export async function refresh() {
  const told = await get("runs"), seen = JSON.stringify(told);
  if (seen === kept.seen) return false;
  Object.assign(kept, told, {seen});
  document.getElementById("folder").textContent = told.folder;
  return true;
}

export const rowOf = key => kept.runs.find(row => row.key === key);

function matches(row) {
  const words = filter.text.toLowerCase().split(/\s+/).filter(Boolean);
  const text = [row.run_id, row.started, row.payload, row.specimen, row.batch, row.plan, row.rig, row.operator,
    row.verdict, row.status, row.tags].join(" ").toLowerCase();
  return words.every(word => text.includes(word)) && (filter.simulated || !row.simulated);
}

const empty = () => h("div", {className: "panel empty"}, "No runs in this folder yet. This makes one:", h("br"), h("code", {}, NO_RUN));

export function runsView(place) {
  const search = h("input", {type: "search", placeholder: "Filter: payload, verdict, rig, date …", value: filter.text,
    size: 34, "aria-label": "Filter the runs", oninput: () => { filter.text = search.value; draw(); }});
  const simulated = h("input", {type: "checkbox", checked: filter.simulated,
    onchange: () => { filter.simulated = simulated.checked; draw(); }});
  const compare = h("button", {onclick: () => { location.hash = `#/compare/${[...ticked].map(encodeURIComponent).join("/")}`; }});
  const count = h("span", {className: "soft", role: "status"});
  const live = h("div"), trend = h("section", {className: "panel"}), body = h("div");
  const bar = h("div", {className: "bar"}, search, h("label", {}, simulated, "simulated"), count,
    h("span", {className: "end"}, compare));
  let chart = null;

  function drawTrend(rows) {
    chart?.end();
    chart = null;
    const measured = rows.filter(row => row.chord_n_per_m !== null && row.low_n_per_m !== null).reverse();
    const often = Object.entries(Object.groupBy(measured, row => row.payload)).sort((a, b) => b[1].length - a[1].length);
    const [payload, known] = often.find(([name]) => name === filter.payload) ?? often[0] ?? ["", []];
    trend.hidden = known.length < 2;
    if (trend.hidden) return;
    const payloads = h("select", {"aria-label": "Payload of the trend", onchange: () => { filter.payload = payloads.value; drawTrend(rows); }},
      often.filter(each => each[1].length > 1).map(([name, of]) => h("option", {value: name, selected: name === payload}, `${name} (${of.length})`)));
    const {place: head, readout} = legend([{name: "identified", colour: "--good"}, {name: "other verdict; open circles: simulated", colour: "--doubt"}]);
    const host = h("div", {role: "img", "aria-label": `Chord stiffness of ${known.length} runs of ${payload} with 95 % intervals; the table has the numbers`});
    trend.replaceChildren(h("div", {className: "title"}, h("h2", {}, "Trend of the chord stiffness, 95 % intervals"), payloads), head, host);
    chart = trendChart(host, readout, known);
  }

  function draw() {
    const rows = kept.runs.filter(matches);
    compare.textContent = `Compare ${ticked.size || ""} ticked`.replace("  ", " ");
    compare.disabled = !ticked.size;
    count.textContent = rows.length === kept.runs.length ? `${rows.length} runs` : `${rows.length} of ${kept.runs.length} runs`;
    live.replaceChildren(...kept.runs.filter(row => row.live).map(row =>
      h("p", {className: "banner good"}, h("b", {}, "Running now: "), runLink(row), row.simulated ? " (simulated)" : "")));
    bar.hidden = !kept.runs.length;
    if (!kept.runs.length) body.replaceChildren(empty());
    else if (!rows.length) body.replaceChildren(h("p", {className: "panel empty"}, "No run matches this filter."));
    else body.replaceChildren(h("div", {className: "panel scroll"}, h("table", {className: "cards"},
      h("thead", {}, h("tr", {}, h("th", {title: "Compare"}, "☑"), ...HEADS.map(([text, kind]) => h("th", {className: kind}, text)))),
      h("tbody", {}, rows.map(line)))));
    drawTrend(rows);
  }

  function line(row) {
    const tick = h("input", {type: "checkbox", checked: ticked.has(row.key), "aria-label": `Compare ${nameOf(row)} of ${when(row)}`,
      disabled: Boolean(row.problem), onchange: () => {
        ticked[tick.checked ? "add" : "delete"](row.key);
        compare.textContent = `Compare ${ticked.size || ""} ticked`.replace("  ", " ");
        compare.disabled = !ticked.size;
      }});
    const ended = row.live ? h("span", {className: "word good"}, "running") : row.problem ? `not read: ${row.problem}` : row.status;
    const payload = [row.payload, row.specimen].filter(Boolean).join(" · ");
    return h("tr", {}, h("td", {className: "tick"}, tick), h("td", {className: "started"}, runLink(row, when(row) || row.key)),
      h("td", {className: "payload"}, payload), h("td", {className: "rig"}, row.rig), h("td", {className: "verdict"}, verdict(row.verdict)),
      h("td", {className: "num chord"}, row.chord), h("td", {className: "num interval"}, row.interval),
      h("td", {className: "ended"}, row.simulated ? h("span", {className: "simulated"}, "simulated, ") : "", ended),
      h("td", {className: "soft run"}, row.run_id.slice(0, 6)));
  }

  place.append(live, bar, trend, body);
  if (kept.runs.length) draw();
  const end = repeatedly(async () => { if (await refresh()) draw(); }, 2500);
  return () => {
    end();
    chart?.end();
  };
}

const HEADS = [["started", ""], ["payload · specimen", ""], ["rig", ""], ["verdict", ""], ["chord", "num"], ["95 %", "num"], ["ended", ""], ["run", ""]];

export function compareView(place, keys) {
  keys.forEach(key => ticked.add(key));
  const head = h("div"), host = h("div", {role: "img", "aria-label": "Force against deformation of the ticked runs"}), body = h("div"), curves = new Map();
  const problems = h("div", {role: "status"});
  const colours = new Map();
  let chart = null, over = false;

  function colourOf(key) {
    if (!colours.has(key)) colours.set(key, COLOURS.find(each => ![...colours.values()].includes(each)) ?? COLOURS[colours.size % COLOURS.length]);
    return colours.get(key);
  }

  async function draw() {
    const rows = kept.runs.filter(row => !row.problem);
    for (const key of [...colours.keys()]) if (!ticked.has(key)) colours.delete(key);
    const shown = rows.filter(row => ticked.has(row.key));
    shown.forEach(row => colourOf(row.key));
    body.replaceChildren(rows.length ? h("div", {className: "panel scroll"}, h("table", {className: "cards"},
      h("thead", {}, h("tr", {}, h("th", {}, "curve"), h("th", {}, "started"), h("th", {}, "payload · specimen"), h("th", {}, "verdict"),
        h("th", {className: "num"}, "chord"), h("th", {className: "num"}, "95 %"))),
      h("tbody", {}, rows.map(line)))) : empty());
    problems.replaceChildren();
    for (const row of shown) {
      if (!curves.has(row.key)) {
        try {
          curves.set(row.key, await get("curves", {run: row.key}));
        } catch (error) {
          curves.set(row.key, {problem: error.message, curve: {}});
        }
      }
      if (over) return;
      const {problem} = curves.get(row.key);
      if (problem) problems.append(h("p", {className: "banner doubt"}, `${nameOf(row)}, ${when(row)}: ${problem}`));
    }
    const drawn = shown.filter(row => curves.get(row.key)?.curve.force_n);
    const {place: names, readout} = legend(drawn.map(row => ({name: `${nameOf(row)} ${row.run_id.slice(0, 6)}`, colour: colourOf(row.key)})));
    head.replaceChildren(h("h2", {}, "Force against deformation"), names, ...(shown.length ? [] : [h("p", {className: "soft"}, "Tick runs below.")]));
    chart?.end();
    chart = curveChart(host, readout, drawn.map(row => {
      const {deformation_um: x, force_n: y} = curves.get(row.key).curve;
      return {x, y, colour: colourOf(row.key), width: 1.4};
    }));
    chart.height = 420;
    chart.plot.setSize(chart.size());
  }

  function line(row) {
    const on = ticked.has(row.key), dot = h("i", {className: "dot"});
    dot.style.setProperty("--c", on ? `var(${colourOf(row.key)})` : "transparent");
    const tick = h("input", {type: "checkbox", checked: on, "aria-label": `Show ${nameOf(row)} of ${when(row)}`, onchange: () => {
      ticked[tick.checked ? "add" : "delete"](row.key);
      draw().then(() => body.querySelector(`[data-key="${CSS.escape(row.key)}"]`)?.focus());
    }});
    tick.dataset.key = row.key;
    return h("tr", {}, h("td", {className: "tick"}, dot, tick), h("td", {className: "started"}, runLink(row, when(row))),
      h("td", {className: "payload"}, nameOf(row)), h("td", {className: "verdict"}, verdict(row.verdict)),
      h("td", {className: "num chord"}, row.chord), h("td", {className: "num interval"}, row.interval));
  }

  place.append(h("section", {className: "panel"}, head, host,
    h("p", {className: "soft small"}, "Deformation counts from the first touch of each run; the zero is not fitted.")), problems, body);
  const end = repeatedly(async () => { if ((await refresh()) || !chart) await draw(); }, 5000);
  return () => {
    over = true;
    end();
    chart?.end();
  };
}
