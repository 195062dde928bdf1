// charts.js: what a page gets that wants charts alone.
import { chartOption, draw, echarts, number, palette } from "./charts.js";

window.trocarCharts = { chartOption, draw, echarts, number, palette };
