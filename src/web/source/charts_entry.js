// charts.js: what a page gets that wants charts alone.
import { BarChart, LineChart, ScatterChart } from "echarts/charts";
import { GridComponent, LegendComponent, MarkLineComponent, TooltipComponent } from "echarts/components";
import { SVGRenderer } from "echarts/renderers";
import { chartOption, draw, echarts, number, palette } from "./charts.js";

echarts.use([
  BarChart, LineChart, ScatterChart, GridComponent, LegendComponent, MarkLineComponent, TooltipComponent, SVGRenderer,
]);
window.trocarCharts = { chartOption, draw, echarts, number, palette };
