// The replay page: `trocarViewer.start(data)` builds it from what src/view wrote and drives it by mouse and keys.
import { LineChart } from "echarts/charts";
import { GridComponent, LegendPlainComponent, MarkLineComponent, TooltipComponent } from "echarts/components";
import { SVGRenderer } from "echarts/renderers";
import { echarts, chartOption, number, palette } from "./charts.js";
import { gradient } from "./colours.js";
import { readView } from "./data.js";
import { Stage } from "./stage.js";
import style from "./viewer.css";

echarts.use([LineChart, GridComponent, LegendPlainComponent, MarkLineComponent, TooltipComponent, SVGRenderer]);

const fields = {
  depth: { name: "depth", unit: "mm", scale: 1e3, told: "how far a vertex is inside what it touches" },
  strain: { name: "strain", unit: "%", scale: 100, told: "largest change of length of a spring at the vertex, by size" },
  displacement: { name: "displacement", unit: "mm", scale: 1e3, told: "way from where the vertex rests" },
};

function element(tag, options = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(options)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (key === "text") made.textContent = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

class Page {
  constructor(view) {
    this.view = view;
    this.tick = 0;
    this.playing = false;
    this.shown = view.runs.map((run, k) => k).slice(0, 3);
    const deep = Math.max(...view.runs.map((run) => run.depth.max)) > 0;
    this.look = { field: deep ? "depth" : "displacement", contacts: true, forces: true, mesh: true, part: 1,
      solid: !view.bodies.some((body) => body.kind === "tissue") };
    this.last = Math.max(1, view.ticks) - 1;
    this.readAddress();
    this.build();
    this.stage = new Stage(this.canvas, this.surface, view, !document.body.classList.contains("picture"));
    this.charts();
    this.keys();
    new ResizeObserver(() => this.stage.draw()).observe(this.main);
    this.choose();
    this.go(this.tick);
    this.stage.near(this.close ? 0.4 : 0.95);
  }

  // #tick=120&field=strain&runs=0,1&part=10&near=1&picture=1: a place that can be linked to, and what pictures are made from.
  readAddress() {
    const asked = new URLSearchParams(location.hash.slice(1));
    if (asked.get("field") in fields) this.look.field = asked.get("field");
    const tick = asked.get("tick");
    if (tick === "worst") this.tick = this.worstTick();
    else if (tick !== null && /^\d+$/.test(tick)) this.tick = Math.min(Number(tick), this.last);
    else this.tick = Math.min(this.last, this.worstTick());
    const runs = (asked.get("runs") ?? "").split(",").filter((k) => /^\d+$/.test(k) && Number(k) < this.view.runs.length);
    if (runs.length > 0) this.shown = runs.map(Number);
    if (["1", "10", "100"].includes(asked.get("part"))) this.look.part = Number(asked.get("part"));
    if (asked.get("solid") === "1") this.look.solid = true;
    this.close = asked.get("near") === "1";
    document.body.classList.toggle("picture", asked.get("picture") === "1");
  }

  worstTick() {
    const told = this.view.runs.map((run) => run.worst.depth).filter((one) => one.tick >= 0);
    if (told.length > 0 && told.some((one) => one.value > 0)) return told.reduce((a, b) => (b.value > a.value ? b : a)).tick;
    const forced = this.view.runs.map((run) => run.worst.force).filter((one) => one.tick >= 0);
    return forced.length > 0 ? forced.reduce((a, b) => (b.value > a.value ? b : a)).tick : 0;
  }

  toggle(key, text, words) {
    const button = element("button", { text, title: words, "data-look": key, onclick: () => this.flip(key) });
    return button;
  }
  flip(key) {
    this.look[key] = !this.look[key];
    this.refresh();
  }

  build() {
    const { view } = this;
    document.title = `${view.scene} · trocar`;
    document.head.append(element("style", { text: style }));
    const bar = element("div", { class: "bar" });
    const group = (label, ...inside) =>
      element("div", { class: "group", role: "group", "aria-label": label }, element("label", { text: label }), ...inside);
    this.tissue = view.bodies.some((body) => body.kind === "tissue");
    if (this.tissue) bar.append(group("tissue by", ...Object.entries(fields).map(([key, field]) =>
      element("button", { text: field.name, title: field.told, "data-field": key, onclick: () => this.colourBy(key) }))));
    this.part = element("select", { "aria-label": "scale", title: "where the colour scale ends", onchange: () => {
      this.look.part = Number(this.part.value);
      this.refresh();
    } }, ...[1, 10, 100].map((n) => element("option", { value: n, text: n === 1 ? "whole scale" : `first 1/${n}` })));
    if (this.tissue) bar.append(this.part);
    bar.append(group("show", this.toggle("contacts", "contacts", "points of contact (c)"),
      this.toggle("forces", "forces", "of single contacts green, on the tool blue (f)"),
      this.toggle("mesh", "mesh", "edges of the tissue (m)"), this.toggle("solid", "solid tools", "else see-through (s)")));
    if (view.runs.length > 1) {
      bar.append(group("methods", ...view.runs.map((run, k) =>
        element("button", { text: run.label, "data-run": k, onclick: () => this.toggleRun(k) }))));
    }
    this.rampTop = element("span", { class: "value" });
    this.rampName = element("span", { class: "value" });
    bar.append(group("camera", element("button", { text: "near", id: "near", title: "to the contacts (n)", onclick: () => this.stage.near() }),
      element("button", { text: "back", title: "all of it (r)", onclick: () => this.stage.home() })));
    this.legend = element("div", { class: "legend" }, this.rampName,
      element("div", { class: "ramp", style: `background:${gradient}` }), this.rampTop);
    if (!this.tissue) this.legend.style.display = "none";
    this.canvas = element("canvas", { class: "stage", "aria-label": "3D view; drag to turn, wheel to come nearer" });
    this.surface = element("div", { class: "surface", tabindex: "-1" });
    this.scalebar = element("div", { class: "scalebar" });
    this.main = element("main", {}, this.canvas, this.surface, this.legend, this.scalebar);
    this.play = element("button", { text: "Play", title: "space", id: "play", onclick: () => this.setPlaying(!this.playing) });
    this.slider = element("input", { type: "range", id: "tick", min: 0, max: this.last, step: 1, value: 0, "aria-label": "tick",
      oninput: () => this.go(Number(this.slider.value)) });
    this.time = element("output");
    this.forceBox = element("div", { class: "chart", id: "force" });
    this.depthBox = element("div", { class: "chart", id: "depth" });
    const notes = view.runs.filter((run) => run.note).map((run) => `${run.label}: ${run.note}`).concat(view.notes ?? []);
    document.body.append(
      element("header", {}, element("h1", { text: view.scene }), element("span", { class: "about", text: view.about })),
      ...notes.map((text) => element("div", { class: "warn", role: "alert", text })),
      bar, this.main,
      element("div", { class: "transport" }, this.play, this.slider, this.time),
      element("div", { class: "charts" }, this.forceBox, this.depthBox),
      element("footer", {},
        element("span", { text: view.foot }),
        element("span", {}, ...["space", "play", "← →", "one tick", "⇧ ← →", "ten", "w", "worst tick", "d t p", "colour",
          "c f m s", "show", "n r", "camera near, back"].flatMap((text, k) =>
          [element(k % 2 === 0 ? "kbd" : "span", { text }), k % 2 === 0 ? " " : "   "]))));
  }

  charts() {
    const { view } = this;
    const time = (tick) => tick * view.dt;
    const curve = (run, values, scale) => Array.from(values, (v, t) => [time(t), Number.isFinite(v) ? v * scale : null]);
    const x = { name: "time", unit: "s", min: 0, max: time(this.last) };
    const force = {
      x, y: { name: "force on the tool", unit: "N", zero: true }, tooltip: "axis", lines: [],
      series: [
        ...view.references.filter((one) => one.force).map((one) => ({
          name: one.name, dash: one.solid ? undefined : [6, 3], color: one.solid ? "#a3a9b2" : "#111", width: one.solid ? 3 : 1.3, z: one.solid ? 1 : 4,
          points: curve(null, one.force, 1) })),
        ...view.runs.map((run, k) => ({ name: run.label, color: palette[k % palette.length], points: curve(run, run.magnitude, 1) })),
      ],
    };
    const depth = {
      x, y: { name: "depth left", unit: "mm", zero: true }, tooltip: "axis", lines: [],
      series: view.runs.map((run, k) => ({ name: run.label, color: palette[k % palette.length], points: curve(run, run.deepest, 1e3) })),
    };
    const told = ([box, spec]) => {
      const any = spec.series.some((one) => one.points.some(([, y]) => y !== null));
      if (!any) box.remove();
      return any;
    };
    this.plots = [[this.forceBox, force], [this.depthBox, depth]].filter(told).map(([box, spec]) => {
      const chart = echarts.init(box, null, { renderer: "svg" });
      const option = chartOption(spec);
      if (option.series.length > 0) {
        option.series[0].markLine = { silent: true, symbol: "none", animation: false, label: { show: false },
          lineStyle: { color: "#1d2530", width: 1, type: "solid" }, data: [{ xAxis: 0 }] };
      }
      chart.setOption(option);
      new ResizeObserver(() => chart.resize()).observe(box);
      // A press anywhere in the plot goes to that tick, and drags on.
      const there = (event) => {
        const at = chart.convertFromPixel({ xAxisIndex: 0 }, event.offsetX);
        this.go(Math.round(at / view.dt));
      };
      const inside = (event) => chart.containPixel("grid", [event.offsetX, event.offsetY]);
      chart.getZr().on("mousedown", (event) => { if (inside(event)) { this.dragging = chart; there(event); } });
      chart.getZr().on("mousemove", (event) => { if (this.dragging === chart) there(event); });
      window.addEventListener("mouseup", () => { this.dragging = null; });
      return { chart, id: option.series.length > 0 };
    });
  }

  panels() {
    this.surface.replaceChildren();
    this.cells = this.shown.map((k) => {
      const run = this.view.runs[k];
      const cell = { depth: element("dd"), force: element("dd"), contacts: element("dd"), failed: element("div", { class: "failed" }) };
      const worst = (one, scale, unit) => (one.tick < 0 ? element("dd") : element("button", {
        class: "worst", title: "go there", text: `worst ${number(one.value * scale)} ${unit} at tick ${one.tick}`,
        onpointerdown: (event) => event.stopPropagation(), // a press here is no turn of the camera
        onclick: () => this.go(one.tick) }));
      this.surface.append(element("div", { class: "panel", "data-panel": k }, element("div", { class: "words" },
        element("h2", {}, element("span", { class: "swatch", style: `background:${palette[k % palette.length]}` }), run.label),
        element("div", { class: "methods", text: run.methods }),
        element("dl", {}, element("dt", { text: "depth left" }), cell.depth, worst(run.worst.depth, 1e3, "mm"),
          element("dt", { text: "force" }), cell.force, worst(run.worst.force, 1, "N"),
          element("dt", { text: "contacts" }), cell.contacts, element("dd")),
        cell.failed)));
      return cell;
    });
  }

  // Everything that follows from which runs are shown and how.
  choose() {
    this.panels();
    this.refresh();
  }
  toggleRun(k) {
    this.shown = this.shown.includes(k) ? this.shown.filter((one) => one !== k) : [...this.shown, k].sort((a, b) => a - b);
    if (this.shown.length === 0) this.shown = [k];
    this.choose();
  }
  colourBy(key) {
    this.look.field = key;
    this.refresh();
  }

  refresh() {
    const { view, look } = this;
    const field = fields[look.field];
    const runs = this.shown.map((k) => view.runs[k]);
    const largest = Math.max(...runs.map((run) => run.fields[look.field].max));
    look.top = (largest > 0 ? largest : 1) / look.part;
    // Arrows: one length for the largest force of all methods shown, contacts and tools each.
    look.contactForce = Math.max(...runs.map((run) => run.contact_force_max)) || 0;
    look.toolForce = Math.max(...runs.map((run) => run.worst.force.value)) || 0;
    look.contactScale = look.contactForce > 0 ? (0.22 * this.stage.size) / look.contactForce : 0;
    look.toolScale = look.toolForce > 0 ? (0.35 * this.stage.size) / look.toolForce : 0;
    this.rampName.textContent = `${field.name} 0`;
    this.rampTop.textContent = largest > 0 ? `${number(look.top * field.scale)} ${field.unit}` : `– ${field.unit}`;
    this.part.value = String(look.part);
    for (const button of document.querySelectorAll("[data-field]"))
      button.setAttribute("aria-pressed", button.dataset.field === look.field);
    for (const button of document.querySelectorAll("[data-look]")) button.setAttribute("aria-pressed", look[button.dataset.look]);
    for (const button of document.querySelectorAll("[data-run]"))
      button.setAttribute("aria-pressed", this.shown.includes(Number(button.dataset.run)));
    this.scalebar.replaceChildren();
    if (look.forces) {
      const told = [];
      if (look.contactForce > 0) told.push(`longest green arrow ${number(look.contactForce)} N of one contact`);
      if (look.toolForce > 0 && view.tool) told.push(`longest blue arrow ${number(look.toolForce)} N on the tool`);
      this.scalebar.textContent = told.join(" · ");
    }
    this.go(this.tick);
  }

  go(tick) {
    const { view } = this;
    this.tick = Math.min(this.last, Math.max(0, tick));
    this.slider.value = String(this.tick);
    const ticks = this.stage.show(this.shown, this.tick, this.look);
    this.time.textContent = `tick ${this.tick} of ${view.ticks} · ${(this.tick * view.dt).toFixed(3)} s` +
      (ticks.some((t) => t !== this.tick) ? ` · picture of ${[...new Set(ticks)].join(", ")}` : "");
    this.shown.forEach((k, i) => {
      const run = view.runs[k];
      const cell = this.cells[i];
      const done = run.magnitude.length;
      const at = this.tick < done ? this.tick : -1;
      cell.depth.textContent = at < 0 ? "–" : `${number(run.deepest[at] * 1e3)} mm`;
      cell.force.textContent = at < 0 ? "–" : number(run.magnitude[at]) + (Number.isFinite(run.magnitude[at]) ? " N" : "");
      cell.contacts.textContent = at < 0 || run.counts[at] < 0 ? "–" : number(run.counts[at]);
      cell.failed.textContent = run.outcome === "ok" ? "" : this.tick >= done - 1
        ? `${run.outcome}: ${run.message}` : `ends ${run.outcome} at tick ${Math.max(0, done - 1)}`;
    });
    for (const { chart, id } of this.plots) {
      if (id) chart.setOption({ series: [{ markLine: { data: [{ xAxis: this.tick * view.dt }] } }] });
    }
  }

  setPlaying(playing) {
    this.playing = playing;
    this.play.textContent = playing ? "Pause" : "Play";
    if (!playing) return;
    if (this.tick >= this.last) this.tick = 0;
    const start = { at: performance.now(), tick: this.tick };
    const speed = Math.max(60, this.last / 12); // ticks a second: the whole run in about twelve seconds
    const step = (now) => {
      if (!this.playing) return;
      const tick = Math.round(start.tick + ((now - start.at) / 1000) * speed);
      this.go(tick);
      if (tick >= this.last) this.setPlaying(false);
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  keys() {
    // Who uses the mouse wants the space bar to play, not to press the last button again.
    document.addEventListener("click", (event) => {
      if (event.detail > 0) event.target.closest("button")?.blur();
    });
    const moves = { ArrowLeft: -1, ArrowRight: 1 };
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
      if (event.key === " " && event.target.tagName === "BUTTON") return; // the button's own
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      const letters = {
        d: () => this.colourBy("depth"), t: () => this.colourBy("strain"), p: () => this.colourBy("displacement"),
        c: () => this.flip("contacts"), f: () => this.flip("forces"), m: () => this.flip("mesh"), s: () => this.flip("solid"),
        r: () => this.stage.home(), n: () => this.stage.near(), w: () => this.go(this.worstTick()), " ": () => this.setPlaying(!this.playing),
        Home: () => this.go(0), End: () => this.go(this.last),
      };
      if (key in moves) this.go(this.tick + moves[key] * (event.shiftKey ? 10 : 1));
      else if (key in letters) letters[key]();
      else return;
      event.preventDefault();
    });
  }
}

window.trocarViewer = {
  async start(json) {
    const page = new Page(await readView(json));
    window.trocarViewer.page = page;
    document.documentElement.setAttribute("data-ready", "yes");
    // scenes/make_pictures.sh takes it from here.
    if (document.body.classList.contains("picture")) {
      document.documentElement.setAttribute("data-picture", page.canvas.toDataURL("image/webp", 0.9));
    }
    return page;
  },
};

// The page's own data, where it has some.
const data = document.getElementById("trocar-view");
if (data) {
  window.trocarViewer.start(JSON.parse(data.textContent)).catch((error) => {
    document.body.append(element("p", { class: "warn", role: "alert", text: `This page cannot be shown: ${error.message}` }));
    throw error;
  });
}
