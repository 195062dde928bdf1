// The charts of trocar's pages: a chart drawn by ECharts from a plain description (README.md beside package.json). Used by
// the replay page and by report.html alike; each entry says which parts of ECharts it needs.
import * as echarts from "echarts/core";

// Ten colours that colour-blind readers can distinguish: M. A. Petroff, Accessible Color Sequences for Data
// Visualization, arXiv:2107.02270, 2021. The same list as in src/report/chart.hpp.
export const palette = [
  "#3f90da", "#ffa90e", "#bd1f01", "#94a4a2", "#832db6", "#a96b59", "#e76300", "#b9ac70", "#717581", "#92dadd",
];

// A number as a person reads it: three digits, an exponent only where nothing else is short.
export function number(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(2).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(3)));
}

const withUnit = (axis) => (axis.unit ? `${axis.name} (${axis.unit})` : (axis.name ?? ""));

function axisOption(axis, vertical, zero) {
  const named = axis.categories !== undefined;
  return {
    type: named ? "category" : axis.log ? "log" : "value",
    name: withUnit(axis),
    nameLocation: "middle",
    nameGap: vertical ? 48 : 28,
    nameTextStyle: { color: "#444" },
    data: axis.categories,
    min: axis.min,
    max: axis.max,
    scale: !zero,
    axisLabel: { color: "#555", hideOverlap: true, formatter: named ? undefined : number },
    axisLine: { show: true, onZero: false, lineStyle: { color: "#999" } },
    splitLine: { lineStyle: { color: "#eee" } },
  };
}

// Names are written by users: never as markup.
const plain = (text) => String(text).replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

function pointText(spec, point) {
  const [x, y, label] = point.value;
  const place = spec.x.categories ? spec.x.categories[x] ?? x : `${number(x)} ${spec.x.unit ?? ""}`;
  return (
    `${point.marker}<b>${plain(point.seriesName)}</b>${label ? ` ${plain(label)}` : ""}<br>` +
    `${plain(spec.x.name)} ${plain(place)}<br>${plain(spec.y.name)} ${number(y)} ${plain(spec.y.unit ?? "")}`
  );
}

function axisText(spec, points) {
  if (points.length === 0) return "";
  const x = points[0].value[0];
  const rows = points.map((p) => `${p.marker}${plain(p.seriesName)} <b>${number(p.value[1])}</b>`);
  const place = spec.x.categories ? spec.x.categories[x] ?? x : `${number(x)} ${spec.x.unit ?? ""}`;
  return `${plain(spec.x.name)} ${plain(place)} · ${plain(withUnit(spec.y))}<br>${rows.join("<br>")}`;
}

// ECharts' own option for a description; pure, so that it can be changed before it is drawn.
export function chartOption(spec) {
  const lines = spec.lines ?? [];
  const series = spec.series.map((one, k) => ({
    name: one.name,
    type: one.kind ?? "line",
    data: one.points,
    color: one.color ?? palette[k % palette.length],
    symbol: one.symbol ?? (one.kind === "scatter" || one.markers ? "circle" : "none"),
    symbolKeepAspect: true,
    symbolSize: one.size ?? 8,
    lineStyle: { width: one.width ?? 1.5, type: one.dash ?? "solid" },
    connectNulls: false,
    emphasis: { focus: spec.series.length > 1 ? "series" : "none" },
    z: one.z ?? 2,
  }));
  if (series.length > 0 && lines.length > 0) {
    series[0].markLine = {
      silent: true,
      symbol: "none",
      lineStyle: { color: "#666", type: "dashed", width: 1 },
      data: lines.map((line) => ({
        ...(line.x === undefined ? { yAxis: line.y } : { xAxis: line.x }),
        label: { formatter: line.name ?? "", position: line.x === undefined ? "insideEndTop" : "end", color: "#444" },
      })),
    };
  }
  return {
    animation: false,
    textStyle: { fontFamily: "system-ui, sans-serif" },
    grid: { left: 66, right: 16, top: spec.legend === false ? 14 : 34, bottom: 46 },
    legend: spec.legend === false ? undefined : { top: 0, type: "plain", itemHeight: 9, textStyle: { color: "#333" } },
    tooltip: {
      trigger: spec.tooltip === "axis" ? "axis" : "item",
      confine: true,
      axisPointer: { type: "line", lineStyle: { color: "#bbb" } },
      formatter: (at) => (Array.isArray(at) ? axisText(spec, at) : pointText(spec, at)),
    },
    xAxis: axisOption(spec.x, false, spec.x.zero),
    yAxis: axisOption(spec.y, true, spec.y.zero || spec.series.some((one) => one.kind === "bar")),
    series,
  };
}

// Draws a description into an element that has a height, and follows the element's width. Returns ECharts' chart.
export function draw(element, spec) {
  const chart = echarts.init(element, null, { renderer: "svg" });
  chart.setOption(chartOption(spec));
  new ResizeObserver(() => chart.resize()).observe(element);
  return chart;
}

export { echarts };
