// Opens a report in headless Chromium at desktop and phone width, light and dark, and fails on
// anything that a reader would trip over: an error, a request to elsewhere, a page wider than the
// screen, a serious fault that axe-core finds, a button that does not copy.
//
//   npm install && node check_page.mjs REPORT.html [SCREENSHOT_DIR]
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

// packages are those of the current folder, so that none need to be installed beside this file
const require = createRequire(resolve("package.json"));
const puppeteer = require("puppeteer-core");
const axe = require.resolve("axe-core/axe.min.js");

const [file, screenshots] = process.argv.slice(2);
if (!file) {
  console.error("usage: node check_page.mjs REPORT.html [SCREENSHOT_DIR]");
  process.exit(2);
}
const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu"],
});
const faults = [];
for (const width of [1280, 390]) {
  for (const theme of ["light", "dark"]) {
    const where = `${width} px, ${theme}`;
    const fault = (text) => faults.push(`${where}: ${text}`);
    const page = await browser.newPage();
    page.on("pageerror", (error) => fault(`error: ${error.message}`));
    page.on("console", (message) => message.type() === "error" && fault(`console: ${message.text()}`));
    page.on("request", (request) => /^(file|data):/.test(request.url()) || fault(`request: ${request.url()}`));
    await page.setViewport({ width, height: 900, isMobile: width < 600, hasTouch: width < 600 });
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: theme }]);
    await page.goto(pathToFileURL(file).href);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
    if (wide > 0) fault(`${wide} px wider than the screen`);
    if (screenshots) await page.screenshot({ path: `${screenshots}/report-${width}-${theme}.png`, fullPage: true });
    await page.addScriptTag({ path: axe });
    const { violations } = await page.evaluate(() => axe.run());
    for (const { id, impact, help, nodes } of violations) {
      const text = `axe ${impact}: ${id}: ${help} (${nodes.length}, first ${nodes[0].target})`;
      if (impact === "serious" || impact === "critical") fault(text);
      else console.log(`${where}: ${text}`);
    }
    await page.click("button[data-copy]");
    await page.waitForFunction(() => document.querySelector("button[data-copy]").textContent !== "Copy LaTeX", { timeout: 2000 })
      .catch(() => fault("the button does not copy"));
    await page.close();
  }
}
await browser.close();
faults.forEach((text) => console.error(text));
console.log(faults.length ? `${faults.length} faults` : "no fault at 1280 and 390 px, light and dark");
process.exit(faults.length ? 1 : 0);
