// One run: live while it goes on, with the two requests; its curves and its report when it is over.

import {curveChart, digits, legend, timeChart} from "./charts.js";
import {get, h, keepToken, lost, nameOf, post, token, verdict, when} from "./tools.js";
import {refresh, rowOf} from "./runs.js";

const LATE_S = 1.5;
const GO_ON = "It goes on by p in its own terminal.";
const FORCES = [
  {name: "force", colour: "--force"}, {name: "limit of the run F_lim", colour: "--limit", dash: true},
  {name: "level", colour: "--level"},
];

export function runView(place, [key]) {
  let end = () => {}, over = false;
  const begin = async stop => {
    await refresh();
    if (over) return;
    const row = rowOf(key);
    place.replaceChildren();
    if (!row) throw new Error(`There is no run ${key} in this folder any more.`);
    end = row.live ? liveRun(place, row, told => { end(); begin(told); }) : pastRun(place, row, stop);
  };
  begin().catch(error => place.replaceChildren(h("p", {className: "banner bad", role: "alert"}, error.message)));
  return () => {
    over = true;
    end();
  };
}

function heading(row, text) {
  document.title = `${nameOf(row)} – stepload`;
  const facts = [row.rig && `on ${row.rig}`, when(row), row.operator, row.run_id].filter(Boolean).join(" · ");
  return [h("h1", {}, nameOf(row), text ? h("span", {className: "soft"}, ` ${text}`) : ""),
    h("p", {className: "soft small"}, row.simulated ? h("span", {className: "simulated"}, "SIMULATED · ") : "", facts)];
}

/** Seconds as people say them. */
function clock(seconds) {
  const whole = Math.round(seconds);
  return whole < 100 ? `${whole} s` : `${Math.floor(whole / 60)} min ${String(whole % 60).padStart(2, "0")} s`;
}

function limits(told) {
  const found = [];
  if (told.used_limit_n && told.used_limit_n < told.elastic_limit_n) found.push({name: "F_c used", colour: "--used", dash: [2, 3], value: told.used_limit_n});
  if (told.elastic_limit_n) found.push({name: "elastic limit F_c", colour: "--mark", dash: [2, 3], value: told.elastic_limit_n});
  return found;
}

function panel(title, label, entries) {
  const {place: head, readout} = legend(entries), host = h("div", {role: "img", "aria-label": label});
  return {made: h("section", {className: "panel"}, h("h2", {}, title), head, host), host, readout};
}

function liveRun(place, row, ended) {
  const time = {time_s: [], low_n: [], high_n: [], limit_n: [], level_n: []};
  const curve = {x: [], y: [], colour: "--force", width: 1.8};
  const phase = h("div", {className: "phase", role: "status", "aria-live": "polite"}, "reads the record …");
  const left = h("span", {className: "soft"}), share = h("progress", {max: 1, value: 0, "aria-label": "Share of the run's time"});
  const late = h("span", {className: "word doubt", role: "status"}), facts = {};
  const fact = (name, text) => h("div", {}, h("dt", {}, text), facts[name] = h("dd", {}, "–"));
  const said = h("p", {className: "soft small", role: "status"});
  const margins = h("div", {className: "margins"}), bars = {};
  const forceChart = h("div"), bendChart = h("div");
  let charts = [], run = null, stop = null, drawn = 0, paused = false, waited = false, constants = [];

  const pause = h("button", {onclick: () => request("pause")}, "Pause after step");
  const unload = h("button", {className: "stop", onclick: () => request("stop")}, "Unload and stop");
  const field = h("input", {type: "password", autocomplete: "off", size: 18, id: "token"});
  const lock = h("form", {onsubmit: event => { event.preventDefault(); keepToken(field.value); unlock(); pause.focus(); }},
    h("label", {htmlFor: "token"}, "Token"), " ", field, " ", h("button", {}, "Unlock"));
  const unlock = () => {
    lock.hidden = Boolean(token());
    pause.disabled = paused || !token();
    unload.disabled = !token();
    said.textContent = token() ? "As p and Ctrl+C in the run's own terminal. The page starts no motion."
      : "Pause and stop need the token that `stepload ui` printed.";
  };

  async function request(word) {
    try {
      const told = await post("request", row.key, word);
      if (told.stops) {
        unload.disabled = pause.disabled = true;
        said.textContent = "Stop requested: the step is finished, then the arm unloads and the run ends.";
      } else {
        pause.disabled = paused = true;
        said.textContent = `Pause requested: after this step the arm unloads and waits. ${GO_ON}`;
      }
    } catch (error) {
      said.textContent = error.message;
      if (/token/.test(error.message)) {
        keepToken("");
        unlock();
        said.textContent = error.message;
      }
    }
  }

  function begin(told) {
    run = told;
    for (const [code, name] of Object.entries(told.rules)) {
      const meter = h("div", {className: "meter", role: "meter", "aria-label": name, "aria-valuemin": 0, "aria-valuemax": 100}, h("span"));
      const number = h("span", {className: "num soft"}, "–");
      margins.append(h("b", {}, code), h("div", {className: "name"}, h("span", {}, name), meter), number);
      bars[code] = {meter, number};
    }
  }

  function drawFirst(state) {
    constants = limits(state);
    const forces = panel("Force against its limits", "Force and its limits against time", [...FORCES, ...constants.map(each => ({...each, dash: true}))]);
    const bends = panel("Force against deformation", "Force against deformation since the first touch", [{name: "measured", colour: "--force"}]);
    forceChart.replaceWith(forces.made);
    bendChart.replaceWith(bends.made);
    charts = [timeChart(forces.host, forces.readout, constants), curveChart(bends.host, bends.readout, [curve])];
  }

  function show(state) {
    const level = state.level_n ? `, step ${state.step} (${digits(state.level_n)} N)` : "";
    const words = state.phase === "done" ? "over; it is being evaluated" : `${state.cycle ? `cycle ${state.cycle}` : "before the first cycle"}, ${state.phase}${level}`;
    if (phase.textContent !== words) phase.textContent = words;
    const waits = state.phase === "paused";
    if (waits !== waited) {
      paused = waited = waits;
      pause.disabled = paused || !token();
      said.textContent = waits ? `The run is paused. ${GO_ON}` : "The run goes on.";
    }
    facts.force.textContent = `${digits(state.force_n)} N`;
    facts.limit.textContent = `${digits(state.force_limit_n)} N`;
    facts.elastic.textContent = `${digits(state.elastic_limit_n)} N`;
    facts.deformation.textContent = state.deformation_um === null ? "–" : `${digits(state.deformation_um)} µm`;
    facts.predicted.textContent = `${digits(state.predicted_peak_n)} N`;
    for (const [code, {meter, number}] of Object.entries(bars)) {
      const used = state.margins[code];
      number.textContent = used === undefined ? "–" : `${Math.round(100 * used)} %`;
      meter.firstChild.style.width = `${100 * Math.min(1, used ?? 0)}%`;
      meter.setAttribute("aria-valuenow", Math.round(100 * (used ?? 0)));
      meter.classList.toggle("high", used >= 0.7);
      meter.classList.toggle("full", used >= 1);
    }
  }

  function draw() {
    drawn = 0;
    if (!charts.length) return;
    charts[0].set([time.time_s, time.level_n, time.low_n, time.high_n, time.limit_n,
      ...constants.map(each => time.time_s.map(() => each.value))]);
    charts[1].show([curve]);
  }

  const events = new EventSource(`/api/live?${new URLSearchParams({run: row.key})}`);
  events.onopen = () => {  // a connection that was lost begins again
    lost(false);
    Object.values(time).forEach(each => each.splice(0));
    curve.x.splice(0);
    curve.y.splice(0);
  };
  events.onerror = async () => {
    if (events.readyState !== EventSource.CLOSED) return lost(true);  // it tries again
    await refresh();
    if (!rowOf(row.key)?.live) return ended(stop);
    phase.textContent = "Four pages watch already. Close one, then load this page again.";
  };
  events.onmessage = ({data}) => {
    const told = JSON.parse(data);
    if (told.run && !run) begin(told.run);
    if (told.stop) stop = told.stop;
    if (told.state) {
      if (!charts.length) drawFirst(told.state);
      show(told.state);
      for (const [name, values] of Object.entries(told.time)) time[name].push(...values);
      curve.x.push(...told.curve.deformation_um);
      curve.y.push(...told.curve.force_n);
      drawn ||= requestAnimationFrame(draw);
    }
    if (told.left_s !== undefined) {
      left.textContent = `${clock(told.left_s)} left${run?.virtual ? " of simulated time, which passes faster" : ""}`;
      share.value = told.share;
    }
    if (told.state) late.textContent = told.behind_s > LATE_S ? `shown ${clock(told.behind_s)} late: this computer is busy` : "";
    if (told.ended) {
      events.close();
      if (told.ended === "unread") phase.textContent = `The record cannot be read: ${told.problem}`;
      else ended(stop);
    }
  };

  unlock();
  place.append(
    h("section", {className: "panel"}, ...heading(row, "running"),
      h("div", {className: "bar"}, phase, left, late, h("span", {className: "end bar"}, lock, pause, unload)), share,
      h("dl", {className: "facts"}, fact("force", "Force"), fact("limit", "Limit of the run F_lim"), fact("elastic", "Elastic limit F_c"),
        fact("deformation", "Deformation"), fact("predicted", "Predicted peak")), said),
    h("div", {className: "watch"}, forceChart, bendChart,
      h("section", {className: "panel rules"}, h("h2", {}, "Rules: used share of each limit, 100 % stops"), margins)));
  return () => {
    events.close();
    cancelAnimationFrame(drawn);
    charts.forEach(each => each.end());
  };
}

function pastRun(place, row, stop) {
  let over = false;
  const charts = [], forceChart = h("div", {className: "panel soft"}, "reads the curves …"), bendChart = h("div", {className: "panel soft"});
  const report = h("section", {className: "report"});
  const ends = row.status === "completed" ? "good" : "doubt";
  place.append(
    h("section", {className: "panel"}, ...heading(row),
      row.problem ? h("p", {className: "word bad"}, `not read: ${row.problem}`) : "",
      stop ? h("p", {className: "word bad", role: "alert"}, `STOPPED by ${stop.rule}: ${stop.message}`) : "",
      h("dl", {className: "facts"},
        h("div", {}, h("dt", {}, "Verdict"), h("dd", {}, verdict(row.verdict || "none"))),
        h("div", {}, h("dt", {}, "Chord stiffness"), h("dd", {}, row.chord || "–")),
        h("div", {}, h("dt", {}, "95 % interval"), h("dd", {}, row.interval || "–")),
        h("div", {}, h("dt", {}, "Largest force"), h("dd", {}, row.peak_force_n === null ? "–" : `${digits(row.peak_force_n)} N`)),
        h("div", {}, h("dt", {}, "Ended"), h("dd", {className: `word ${ends}`}, row.status || "–")))),
    h("div", {className: "two"}, forceChart, bendChart), report);
  (async () => {
    const told = await get("curves", {run: row.key});
    if (over) return;
    const constants = limits(told), {time, curve} = told;
    const forces = panel("Force against its limits", "Force and its limits against time", [FORCES[0], FORCES[1], ...constants.map(each => ({...each, dash: true}))]);
    forceChart.replaceWith(forces.made);
    charts.push(timeChart(forces.host, forces.readout, constants));
    const none = time.time_s.map(() => null);
    charts[0].set([time.time_s, none, time.force_n, time.force_n, time.limit_n, ...constants.map(each => none.map(() => each.value))]);
    const bends = panel("Force against deformation", "Force against deformation", [{name: "measured, all cycles", colour: "--force"}]);
    bendChart.replaceWith(bends.made);
    if (told.problem) bends.host.append(h("p", {className: "empty"}, told.problem));
    else charts.push(curveChart(bends.host, bends.readout, [{x: curve.deformation_um, y: curve.force_n, colour: "--force"}]));
    const url = `/api/report?${new URLSearchParams({run: row.key})}`;
    report.append(h("div", {className: "title"}, h("h2", {}, "Report"), h("a", {href: url, target: "_blank", rel: "noopener"}, "open alone")),
      h("iframe", {src: url, title: "Report of the run", sandbox: ""}));
  })().catch(error => forceChart.replaceChildren(error.message));
  return () => {
    over = true;
    charts.forEach(each => each.end());
  };
}
