// Opens a report in headless Chromium at desktop and phone width, light and dark, and fails on
// any fault that a reader would notice: an error, a request to elsewhere, a verdict that is not on the
// first screen or needs its colour, a page wider than the screen or higher than eight of them, too many
// sheets of paper, anything that axe-core finds, an animation that does not play, a button that does not copy.
//
//   npm install && node check_page.mjs REPORT.html [SCREENSHOT_DIR [PICTURE_DIR]]
//
// SCREENSHOT_DIR gets the whole page in each form, PICTURE_DIR the parts that the documentation shows.
import { writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { checkAccess, end, launched, opened } from "./chromium.mjs";

const [file, screenshots, pictures] = process.argv.slice(2);
if (!file) {
  console.error("usage: node check_page.mjs REPORT.html [SCREENSHOT_DIR [PICTURE_DIR]]");
  process.exit(2);
}
/** Highest page as it opens at 1280 px, and most sheets of A4. */
const MOST_PX = 6000, MOST_SHEETS = 8;
/** Height of the first screen by width. */
const SCREEN_PX = { 1280: 800, 390: 844 };
const browser = await launched();
const faults = [];
for (const width of [1280, 390]) {
  for (const theme of ["light", "dark"]) {
    const where = `${width} px, ${theme}`;
    const fault = (text) => faults.push(`${where}: ${text}`);
    const page = await opened(browser, width, SCREEN_PX[width], theme, fault);
    await page.goto(pathToFileURL(file).href);
    const [wide, height] = await page.evaluate(() => {
      const { scrollWidth, scrollHeight } = document.documentElement;
      return [scrollWidth, scrollHeight];
    });
    console.log(`${where}: ${height} px high`);
    if (wide > width) fault(`${wide - width} px wider than the screen`);
    await verdict(page, width, fault);
    if (width === 1280 && height > MOST_PX) fault(`${height} px high, at most ${MOST_PX}`);
    if (screenshots) await page.screenshot({ path: `${screenshots}/report-${width}-${theme}.png`, fullPage: true });
    if (pictures) await picture(page, width, theme);
    await checkAccess(page, fault, ", as opened");
    await film(page, fault);
    if (width === 1280 && theme === "light") await print(page, fault);
    await page.evaluate(() => document.querySelectorAll("details").forEach((details) => { details.open = true; }));
    await checkAccess(page, fault, ", all unfolded");
    if (width === 1280) {
      const cut = await page.evaluate(() => [...document.querySelectorAll(".scroll")]
        .filter((region) => region.scrollWidth > region.clientWidth + 1)
        .map((region) => `${region.ariaLabel}: ${region.scrollWidth - region.clientWidth} px`));
      cut.forEach((text) => fault(`wider than the page: ${text}`));
    }
    await page.click("button[data-copy]");
    await page.waitForFunction(() => document.querySelector("button[data-copy]").textContent !== "Copy LaTeX", { timeout: 2000 })
      .catch(() => fault("the button does not copy"));
    await page.close();
  }
}
await browser.close();
end(faults, "no fault at 1280 and 390 px, light, dark and printed");

/** The verdict is on the first screen, with the figure at desktop width; a sign and a word state each result. */
async function verdict(page, width, fault) {
  const { results, bottoms } = await page.evaluate(() => ({
    results: [...document.querySelectorAll(".uses > table tbody td:last-child")].map((cell) => cell.innerText.trim()),
    bottoms: [".uses > table", ".first > figure svg:last-of-type"].map((part) => document.querySelector(part)?.getBoundingClientRect().bottom),
  }));
  if (results.length !== 4) fault(`${results.length} rows in the verdict, expected 4`);
  results.filter((text) => !/^(✓ passed|✗ failed|– not measured)$/u.test(text)).forEach((text) => fault(`a result without sign and word: ${text}`));
  const needed = width === 1280 ? bottoms : bottoms.slice(0, 1);
  needed.filter((bottom) => !(bottom <= SCREEN_PX[width])).forEach((bottom) => fault(`the verdict ends at ${bottom} px`));
}

/** The first screen, and the first jump on a dark one. */
async function picture(page, width, theme) {
  const name = { "1280-light": "top", "1280-dark": "jump", "390-light": "phone" }[`${width}-${theme}`];
  if (!name) return;
  const y = name === "jump" ? await page.$eval("#jumps", (part) => part.getBoundingClientRect().top + window.scrollY) : 0;
  const clip = { x: 0, y, width, height: name === "jump" ? 1100 : SCREEN_PX[width] };
  await page.screenshot({ path: `${pictures}/report-${name}.png`, clip, captureBeyondViewport: true });
}

/** The animation plays, and its slider sets the instant. */
async function film(page, fault) {
  const points = () => page.$eval(".film svg g polyline", (line) => line.getAttribute("points"));
  const before = await points();
  await page.$eval(".film input", (slider) => {
    slider.value = 0;
    slider.dispatchEvent(new Event("input"));
  });
  const first = await points();
  if (first === before) fault("the slider does not move the robot");
  await page.click(".film button");
  await page.waitForFunction((old) => document.querySelector(".film svg g polyline").getAttribute("points") !== old,
    { timeout: 3000 }, first).catch(() => fault("the animation does not play"));
  await page.click(".film button");
}

/** The page on paper: few sheets, nothing beyond their edge. */
async function print(page, fault) {
  const pdf = Buffer.from(await page.pdf({ format: "A4", preferCSSPageSize: true }));
  const sheets = pdf.toString("latin1").match(/\/Type\s*\/Page\b(?!s)/g)?.length ?? 0;
  console.log(`printed: ${sheets} sheets`);
  if (sheets < 1 || sheets > MOST_SHEETS) fault(`printed on ${sheets} sheets, at most ${MOST_SHEETS}`);
  if (screenshots) writeFileSync(`${screenshots}/report.pdf`, pdf);
  await page.emulateMediaType("print");
  const cut = await page.evaluate(() => {
    const sheet = document.body;
    sheet.style.width = "186mm";
    const edge = sheet.getBoundingClientRect().right + 1;
    const beyond = [...document.querySelectorAll("table, math, svg, p, pre")].filter((part) => part.getBoundingClientRect().right > edge);
    sheet.style.width = "";
    return beyond.map((part) => `${part.tagName} ${part.textContent.slice(0, 30)}`);
  });
  cut.forEach((text) => fault(`printed beyond the edge: ${text}`));
  await page.emulateMediaType("screen");
}
