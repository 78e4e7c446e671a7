// Charts: uPlot with the colours of the page, its size, and units on every axis.

const shown = new Set();
const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const FONT = '12px system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif';

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => shown.forEach(each => each.make()));

/** A number as it is read: three digits, or as many as stand before the point. */
export function digits(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  return value.toFixed(size >= 99.95 ? 0 : size >= 9.995 ? 1 : size >= 0.0995 ? 2 : size ? 3 : 0).replace("-", "−");
}

class Chart {
  /** `options(colour)` gives uPlot's options; `data` is what uPlot takes. */
  constructor(host, options, data, height = 300) {
    Object.assign(this, {host, options, data, height, plot: null});
    host.classList.add("chart");
    this.sizes = new ResizeObserver(() => this.plot?.setSize(this.size()));
    shown.add(this);
    this.make();
    this.sizes.observe(host);
  }
  size() {
    return {width: Math.max(220, this.host.clientWidth), height: this.height};
  }
  make() {
    this.plot?.destroy();
    this.plot = new uPlot({...this.size(), ...this.options(style)}, this.data, this.host);
  }
  set(data) {
    this.data = data;
    this.plot.setData(data);
  }
  end() {
    shown.delete(this);
    this.sizes.disconnect();
    this.plot.destroy();
  }
}

function axis(label, more = {}) {
  return {
    label, labelFont: FONT, font: FONT, labelSize: 18, labelGap: 2, gap: 4, stroke: style("--soft"),
    values: (_, ticks) => ticks.map(each => each === null ? "" : String(Number(each.toPrecision(6))).replace("-", "−")),
    grid: {stroke: style("--line"), width: 1}, ticks: {stroke: style("--line"), width: 1, size: 4}, ...more,
  };
}

const fromZero = (_, low, high) => {
  if (low === null || high === null) return [0, 1];
  const [least, most] = [Math.min(0, low), Math.max(high, 1e-9)];
  return [least < 0 ? least - 0.04 * (most - least) : 0, most + 0.06 * (most - least)];
};

const frame = (readout, tell) => ({
  legend: {show: false}, padding: [10, 12, 0, 0],
  cursor: {points: {show: false}, drag: {x: true, y: true, uni: 20}},
  hooks: {setCursor: [plot => {
    const {left, top} = plot.cursor;
    if (readout) readout.textContent = left < 0 ? "" : tell(plot, plot.posToVal(left, "x"), plot.posToVal(top, "y"));
  }]},
});

const TALL = () => innerWidth > 1080 ? 372 : 300;

/** Force against time: data [time s, level, low, high, limit], levels of F_c as constants. */
export function timeChart(host, readout, constants) {
  const lines = colour => [
    {}, {label: "level", stroke: colour("--level"), width: 1},
    {label: "low", stroke: colour("--force"), width: 1}, {label: "high", stroke: colour("--force"), width: 1.4},
    {label: "limit", stroke: colour("--limit"), width: 1.6, dash: [7, 4]},
    ...constants.map(each => ({label: each.name, stroke: colour(each.colour), width: 1.2, dash: each.dash})),
  ].map(each => ({...each, points: {show: false}, spanGaps: false}));
  const tell = (_, x, y) => `${digits(x)} s, ${digits(y)} N`;
  return new Chart(host, colour => ({
    ...frame(readout, tell), series: lines(colour), bands: [{series: [3, 2], fill: colour("--bandfill")}],
    scales: {x: {time: false}, y: {range: fromZero}},
    axes: [axis("Time in s", {size: 26}), axis("Force in N", {size: 42})],
  }), [[], [], [], [], [], ...constants.map(() => [])], TALL());
}

/** Force against deformation: curves {x µm, y N, colour, dash, width}; x need not rise. */
export function curveChart(host, readout, curves = []) {
  const path = curve => (plot, index) => {
    const [xs, ys] = plot.data[index], {ctx, bbox} = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.beginPath();
    let pen = false;
    for (let i = 0; i < xs.length; i++) {
      const there = xs[i] !== null && ys[i] !== null;
      if (there) ctx[pen ? "lineTo" : "moveTo"](plot.valToPos(xs[i], "x", true), plot.valToPos(ys[i], "y", true));
      pen = there;
    }
    ctx.strokeStyle = style(curve.colour);
    ctx.lineWidth = (curve.width ?? 1.6) * devicePixelRatio;
    ctx.lineJoin = "round";
    ctx.setLineDash((curve.dash ?? []).map(each => each * devicePixelRatio));
    ctx.stroke();
    ctx.restore();
    return null;
  };
  const facets = [{scale: "x", auto: true}, {scale: "y", auto: true}];
  const tell = (_, x, y) => `${digits(x)} µm, ${digits(y)} N`;
  const data = curves => [null, ...curves.map(each => [each.x, each.y])];
  const chart = new Chart(host, () => ({
    ...frame(readout, tell), mode: 2,
    series: [{}, ...curves.map(each => ({facets, paths: path(each), stroke: style(each.colour)}))],
    scales: {x: {time: false, auto: true, range: fromZero}, y: {auto: true, range: fromZero}},
    axes: [axis("Deformation in µm", {size: 26}), axis("Force in N", {size: 42})],
  }), data(curves), TALL());
  chart.show = next => {
    const same = next.length === curves.length;
    curves = next;
    chart.data = data(next);
    if (same) chart.plot.setData(chart.data);
    else chart.make();
  };
  return chart;
}

/** Stiffness of runs in their order, each with its 95 % interval. */
export function trendChart(host, readout, rows) {
  const values = rows.map(row => row.chord_n_per_m);
  const [factor, unit] = Math.max(...values) >= 1e6 ? [1e-6, "MN/m"] : [1e-3, "kN/m"];
  const scaled = key => rows.map(row => row[key] * factor);
  const whiskers = plot => {
    const {ctx} = plot, radius = 4 * devicePixelRatio;
    ctx.save();
    rows.forEach((row, i) => {
      const at = (value, scale) => plot.valToPos(value, scale, true);
      const x = at(i + 1, "x"), low = at(row.low_n_per_m * factor, "y"), high = at(row.high_n_per_m * factor, "y");
      ctx.strokeStyle = ctx.fillStyle = style(row.verdict === "identified" ? "--good" : "--doubt");
      ctx.lineWidth = 1.4 * devicePixelRatio;
      ctx.beginPath();
      ctx.moveTo(x, low);
      ctx.lineTo(x, high);
      for (const end of [low, high]) {
        ctx.moveTo(x - radius, end);
        ctx.lineTo(x + radius, end);
      }
      ctx.stroke();
      ctx.beginPath();
      ctx.arc(x, at(row.chord_n_per_m * factor, "y"), radius * 0.85, 0, 7);
      if (row.simulated) ctx.fillStyle = style("--paper");
      ctx.fill();
      ctx.stroke();
    });
    ctx.restore();
  };
  const tell = (_, x) => {
    const row = rows[Math.round(x) - 1];
    return row ? `${row.specimen || row.payload}: ${row.chord} ${row.interval}` : "";
  };
  return new Chart(host, () => {
    const made = frame(readout, tell);
    const labels = (_, ticks) => ticks.map(each =>
      Number.isInteger(each) && rows[each - 1] ? rows[each - 1].started.slice(5, 16).replace("T", " ") : "");
    return {
      ...made, hooks: {...made.hooks, draw: [whiskers]},
      series: [{}, ...[0, 1, 2].map(() => ({stroke: "transparent", points: {show: false}}))],
      scales: {
        x: {time: false, range: () => [0.5, rows.length + 0.5]},
        y: {range: (_, low, high) => [low - 0.1 * (high - low || low), high + 0.1 * (high - low || high)]},
      },
      axes: [axis("Runs in order of time", {values: labels, incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500], space: 90, size: 26}),
        axis(`Chord stiffness in ${unit}`, {size: 46})],
    };
  }, [rows.map((_, i) => i + 1), scaled("chord_n_per_m"), scaled("low_n_per_m"), scaled("high_n_per_m")], 210);
}

/** A legend with a place for the values at the cursor. */
export function legend(entries) {
  const place = document.createElement("p"), readout = document.createElement("output");
  place.className = "legend";
  for (const {name, colour, dash} of entries) {
    const entry = document.createElement("span"), line = document.createElement("i");
    line.style.setProperty("--c", `var(${colour})`);
    if (dash) line.className = "dash";
    entry.append(line, name);
    place.append(entry);
  }
  place.append(readout);
  return {place, readout};
}
