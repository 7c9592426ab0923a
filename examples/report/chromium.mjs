// Headless Chromium and axe-core for the checks of pages. Packages are those of the current folder, so that none need to be
// installed in that of this file.
import { createRequire } from "node:module";
import { resolve } from "node:path";

export const require = createRequire(resolve("package.json"));

export function launched() {
  return require("puppeteer-core").launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"],
  });
}

/** A page of this size and theme that reports errors and requests to elsewhere to `fault`. */
export async function opened(browser, width, height, theme, fault) {
  const page = await browser.newPage();
  page.on("pageerror", (error) => fault(`error: ${error.message}`));
  page.on("console", (message) => message.type() === "error" && fault(`console: ${message.text()}`));
  page.on("request", (request) => /^(file|data|blob):/.test(request.url()) || fault(`request: ${request.url()}`));
  await page.setViewport({ width, height, isMobile: width < 600, hasTouch: width < 600 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: theme }]);
  return page;
}

/** Reports what axe-core finds in a page as it is now. */
export async function checkAccess(page, fault, state = "") {
  if (!(await page.evaluate(() => "axe" in window))) {
    await page.addScriptTag({ path: require.resolve("axe-core/axe.min.js") });
  }
  const { violations } = await page.evaluate(() => axe.run());
  for (const { id, impact, help, nodes } of violations) {
    fault(`axe ${impact}${state}: ${id}: ${help} (${nodes.length}, first ${nodes[0].target})`);
  }
}

/** Prints all faults, or that there are none, and ends the program. */
export function end(faults, sound) {
  faults.forEach((text) => console.error(text));
  console.log(faults.length ? `${faults.length} faults` : sound);
  process.exit(faults.length ? 1 : 0);
}
