// Makes the two committed scripts from the sources: `npm ci && npm run build` in this folder. Nobody needs this to build
// or run trocar; the same lock file gives the same bytes.
import { build } from "esbuild";
import { copyFileSync, mkdirSync, readFileSync } from "node:fs";

const version = (name) => JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8")).version;
const echarts = `Apache ECharts ${version("echarts")} (Apache-2.0), zrender ${version("zrender")} (BSD-3-Clause), ` +
  `tslib ${version("tslib")} (0BSD)`;
const three = `three.js ${version("three")} (MIT)`;

async function bundle(entry, output, contents) {
  await build({
    entryPoints: [`source/${entry}`],
    outfile: output,
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2020",
    charset: "utf8",
    loader: { ".css": "text" },
    legalComments: "none",
    define: { "process.env.NODE_ENV": '"production"' },
    banner: { js: `/* trocar; contains ${contents}; licences in src/web/licences */` },
    logLevel: "info",
  });
}

mkdirSync("licences", { recursive: true });
for (const [name, file] of [
  ["echarts", "LICENSE"], ["echarts", "NOTICE"], ["echarts", "licenses/LICENSE-d3"], ["zrender", "LICENSE"],
  ["tslib", "LICENSE.txt"], ["three", "LICENSE"],
]) {
  copyFileSync(`node_modules/${name}/${file}`, `licences/${name}-${file.split("/").pop().replace(".txt", "")}`);
}
await bundle("charts_entry.js", "charts.js", echarts);
await bundle("viewer.js", "viewer.js", `${three}, ${echarts}`);
