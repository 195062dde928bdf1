#include "report/html_parts.hpp"

namespace trocar {

const char* const page_style = R"(
:root { --ink: #1b2027; --soft: #5c6672; --line: #d8dde3; --band: #f5f7f9; --own: #0b5cad; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: #fff; display: flex; align-items: flex-start;
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", "Noto Sans", "DejaVu Sans", Arial, sans-serif; }
main { flex: 1 1 auto; min-width: 0; max-width: 1560px; margin: 0 auto; padding: 24px 24px 64px; }
nav { flex: 0 0 210px; position: sticky; top: 0; max-height: 100vh; overflow-y: auto; padding: 28px 0 24px 20px;
  font-size: 13.5px; line-height: 1.35; }
nav a { color: var(--own); text-decoration: none; display: block; padding: 3px 0; }
nav a:hover { text-decoration: underline; }
h1 { font-size: 24px; line-height: 1.25; margin: 0 0 8px; }
h2 { font-size: 20px; margin: 40px 0 10px; padding-top: 10px; border-top: 2px solid var(--ink); }
h3 { font-size: 16px; margin: 24px 0 6px; }
p { margin: 8px 0; max-width: 90ch; }
code { font: 0.92em "SF Mono", "DejaVu Sans Mono", Menlo, Consolas, monospace; overflow-wrap: break-word; }
pre { background: var(--band); border: 1px solid var(--line); border-radius: 4px; padding: 10px 14px; overflow-x: auto; }
blockquote { margin: 12px 0; padding: 10px 18px; border-left: 4px solid var(--own); background: #f1f6fb; font-size: 17px; }
blockquote p { max-width: none; margin: 0; }
.page-one { max-width: 1080px; }
.warning { border-left: 4px solid #b3541e; background: #fdf4ee; padding: 6px 14px; max-width: none; font-size: 14px; }
.small, .note { color: var(--soft); font-size: 13px; max-width: 120ch; }
.scroll { overflow-x: auto; margin: 10px 0 4px; background:
  linear-gradient(to right, #fff 12px, #fff0) left / 40px 100% no-repeat local,
  linear-gradient(to left, #fff 12px, #fff0) right / 40px 100% no-repeat local,
  linear-gradient(to right, #1b202755, #1b202700) left / 14px 100% no-repeat,
  linear-gradient(to left, #1b202755, #1b202700) right / 14px 100% no-repeat; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; width: 100%; }
caption { text-align: left; font-weight: 600; font-size: 14px; padding: 4px 0 6px; }
thead th { border-top: 2px solid var(--ink); border-bottom: 1px solid var(--ink); text-align: left; vertical-align: bottom;
  padding: 5px 8px 5px 4px; font-weight: 600; line-height: 1.3; }
th abbr { text-decoration: underline dotted; text-underline-offset: 3px; cursor: help; }
th[aria-sort] { cursor: pointer; }
th[aria-sort="ascending"]::after { content: " \25B2"; } th[aria-sort="descending"]::after { content: " \25BC"; }
tbody td { padding: 4px 8px 4px 4px; border-bottom: 1px solid var(--line); vertical-align: top; }
tbody tr:last-child td { border-bottom: 2px solid var(--ink); }
th.number, td.number { text-align: right; padding-right: 6px; }
tr > :first-child { position: sticky; left: 0; background: #fff; }
table:has(th:nth-child(13)) { font-size: 12px; } table:has(th:nth-child(13)) :is(td, th) { padding-left: 2px; padding-right: 5px; }
table:has(th:nth-child(19)) { font-size: 11px; } table:has(th:nth-child(19)) :is(td, th) { padding-right: 3px; }
th.wide { width: 32%; }
.range { display: block; color: var(--soft); font-size: 11.5px; }
tr.dominated .range { color: inherit; }
tr.own td:first-child { color: var(--own); font-weight: 600; }
tr.dominated td { color: #6d7680; }
tr.failed td { color: #a32020; }
tr.elsewhere { display: none; }
.page-filters select { font: inherit; margin-right: 8px; }
.filter { font: inherit; font-size: 13px; padding: 2px 6px; margin: 8px 0 0; border: 1px solid var(--line); border-radius: 4px; }
td.again { width: 1px; text-align: right; }
td.again button { font: inherit; font-size: 12px; line-height: 1.2; color: var(--soft); background: none; border: 1px solid var(--line);
  border-radius: 4px; cursor: pointer; padding: 0 5px; }
tr.command td { background: var(--band); white-space: normal; text-align: left; }
details { margin: 10px 0; } summary { cursor: pointer; font-weight: 600; font-size: 14px; }
figure { margin: 16px 0; max-width: 1180px; } figure svg { max-width: 100%; height: auto; display: block; }
figure .chart { height: 500px; } figure .chart svg { max-width: none; }
figcaption { color: var(--soft); font-size: 13px; max-width: 120ch; }
@media (max-width: 1000px) {
  body { display: block; } main { padding: 8px 14px 48px; }
  tr > :first-child { position: static; }
  nav { position: static; max-height: none; columns: 2; padding: 10px 14px; border-bottom: 1px solid var(--line); }
}
@media print {
  body { display: block; font-size: 9.5pt; } main { max-width: none; padding: 0; } h2 { break-after: avoid; }
  table { font-size: 7.5pt; } tr, figure, blockquote { break-inside: avoid; } thead { display: table-header-group; }
  .scroll { overflow: visible; background: none; } .page-one { break-after: page; max-width: none; }
  nav, .filter, .again, figure .chart { display: none; } figure > svg { display: block !important; }
  @page { size: A4 landscape; margin: 12mm; }
}
)";

const char* const page_script = R"(
"use strict";
(function () {
  // What a cell is sorted by: its first number, else its text; what has no number goes last.
  function key(row, column) {
    var cell = row.cells[column];
    if (!cell) return null;
    var text = cell.textContent.trim();
    if (!cell.classList.contains("number")) return text;
    var found = text.match(/∞|-?\d+(\.\d+)?(e[-+]?\d+)?/i);
    return !found ? null : found[0] === "∞" ? Infinity : parseFloat(found[0]);
  }
  function closeCommands(body) {
    body.querySelectorAll("tr.command").forEach(function (row) { row.remove(); });
  }
  function sortBy(table, head, column) {
    var up = head.getAttribute("aria-sort") !== "ascending";
    table.querySelectorAll("th[aria-sort]").forEach(function (th) { th.setAttribute("aria-sort", "none"); });
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    var body = table.tBodies[0];
    closeCommands(body);
    Array.from(body.rows).map(function (row, i) { return { row: row, key: key(row, column), i: i }; })
      .sort(function (a, b) {
        if (a.key === null || b.key === null) return (a.key === null) - (b.key === null) || a.i - b.i;
        var order = a.key < b.key ? -1 : a.key > b.key ? 1 : 0;
        return (up ? order : -order) || a.i - b.i;
      }).forEach(function (one) { body.appendChild(one.row); });
  }
  function addFilter(table) {
    var input = document.createElement("input");
    input.className = "filter";
    input.type = "search";
    input.placeholder = "filter rows";
    input.setAttribute("aria-label", "Show only rows that hold these words");
    input.addEventListener("input", function () {
      closeCommands(table.tBodies[0]);
      var words = input.value.toLowerCase().split(/\s+/);
      Array.from(table.tBodies[0].rows).forEach(function (row) {
        var text = row.textContent.toLowerCase();
        row.hidden = !words.every(function (word) { return text.indexOf(word) >= 0; });
      });
    });
    table.parentNode.parentNode.insertBefore(input, table.parentNode);
  }
  function copy(text) {
    if (navigator.clipboard && window.isSecureContext) return navigator.clipboard.writeText(text).catch(function () {});
    var area = document.createElement("textarea");
    area.value = text;
    document.body.appendChild(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  // The command stands under its row and is in the clipboard; a second click takes it away.
  function showCommand(row, command) {
    var next = row.nextElementSibling;
    if (next && next.classList.contains("command")) { next.remove(); return; }
    var line = document.createElement("tr");
    line.className = "command";
    var cell = line.appendChild(document.createElement("td"));
    cell.colSpan = row.cells.length;
    cell.appendChild(document.createElement("code")).textContent = command;
    row.after(line);
    copy(command);
  }
  function addCommands(table) {
    var rows = Array.from(table.tBodies[0].rows);
    var all = table.dataset.command;
    if (!all && !rows.some(function (row) { return row.dataset.command; })) return;
    table.tHead.rows[0].appendChild(document.createElement("th")).className = "again";
    rows.forEach(function (row) {
      var command = row.dataset.command || all;
      var cell = row.insertCell();
      cell.className = "again";
      if (!command) return;
      var button = cell.appendChild(document.createElement("button"));
      button.type = "button";
      button.textContent = "$";
      button.title = "Makes this row again, copied by a click:\n" + command;
      button.addEventListener("click", function () { showCommand(row, command); });
    });
  }
  document.querySelectorAll("main table").forEach(function (table) {
    Array.from(table.tHead.rows[0].cells).forEach(function (head, column) {
      head.setAttribute("aria-sort", "none");
      head.tabIndex = 0;
      head.addEventListener("click", function () { sortBy(table, head, column); });
      head.addEventListener("keydown", function (event) { if (event.key === "Enter") sortBy(table, head, column); });
    });
    if (table.tBodies[0].rows.length > 10) addFilter(table);
    addCommands(table);
  });
  // One select per column that all tables of the page have in common; a row is shown where all selects agree.
  function addPageFilters(headers) {
    var tables = Array.from(document.querySelectorAll("main table"));
    var bar = document.createElement("p");
    bar.className = "page-filters";
    var selects = headers.map(function (header) {
      var select = document.createElement("select");
      select.setAttribute("aria-label", header);
      var values = new Set();
      tables.forEach(function (table) {
        var column = columnOf(table, header);
        if (column >= 0) Array.from(table.tBodies[0].rows).forEach(function (row) { values.add(row.cells[column].textContent); });
      });
      select.add(new Option("every " + header, ""));
      Array.from(values).sort().forEach(function (value) { select.add(new Option(value, value)); });
      select.addEventListener("change", show);
      bar.appendChild(select);
      return { header: header, select: select };
    });
    function columnOf(table, header) {
      return Array.from(table.tHead.rows[0].cells).findIndex(function (cell) { return cell.textContent === header; });
    }
    function show() {
      tables.forEach(function (table) {
        closeCommands(table.tBodies[0]);
        Array.from(table.tBodies[0].rows).forEach(function (row) {
          row.classList.toggle("elsewhere", selects.some(function (one) {
            var column = columnOf(table, one.header);
            return column >= 0 && one.select.value && row.cells[column].textContent !== one.select.value;
          }));
        });
      });
    }
    var title = document.querySelector("main h1");
    title.parentNode.insertBefore(bar, title.nextSibling);
  }
  var filters = document.querySelector("main").dataset.filters;
  if (filters) addPageFilters(filters.split(","));
  if (!window.trocarCharts) return;
  var draw = function (figure) {
    var box = document.createElement("div");
    box.className = "chart";
    figure.querySelector("svg").style.display = "none";
    figure.insertBefore(box, figure.firstChild);
    var spec = JSON.parse(figure.dataset.chart);
    if (spec.height) box.style.height = spec.height + "px";
    var option = window.trocarCharts.chartOption(spec);
    if (option.legend) option.legend.type = "scroll";
    try {
      var chart = window.trocarCharts.echarts.init(box, null, { renderer: "svg" });
      chart.setOption(option);
      new ResizeObserver(function () { chart.resize(); }).observe(box);
    } catch (fault) {  // the drawing reports the same
      box.remove();
      figure.querySelector("svg").style.display = "";
      throw fault;
    }
  };
  window.trocarDraw = draw;
  // Drawn when they come into view: a report has dozens.
  var seen = new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      if (!entry.isIntersecting) return;
      seen.unobserve(entry.target);
      draw(entry.target);
    });
  }, { rootMargin: "400px" });
  document.querySelectorAll("figure[data-chart]").forEach(function (figure) { seen.observe(figure); });
})();
)";

}  // namespace trocar
