// Opens every page of the documentation site, and the README as GitHub renders it, in headless Chromium at desktop and
// phone width, light and dark. Fails on an error, a request to elsewhere, a page wider than the screen, a picture that
// does not load, and anything that axe-core finds.
//
//   npm install && node check_site.mjs REPOSITORY SITE [SCREENSHOT_DIR]
//
// SITE is the folder that `mdbook build docs` writes; SCREENSHOT_DIR gets the first screens of every page in each form.
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join, relative } from "node:path";
import { pathToFileURL } from "node:url";
import { checkAccess, end, launched, opened, require } from "./chromium.mjs";

const [repository, site, screenshots] = process.argv.slice(2);
if (!site) {
  console.error("usage: node check_site.mjs REPOSITORY SITE [SCREENSHOT_DIR]");
  process.exit(2);
}
/** Heights by width, px. */
const SCREENS = { 1280: 900, 390: 844 };

/** The README with GitHub's style sheet, as a page in the repository so that its pictures load. */
async function readme() {
  const { marked } = await import(pathToFileURL(require.resolve("marked")));
  const style = readFileSync(require.resolve("github-markdown-css/github-markdown.css"), "utf8");
  // GitHub underlines links, and its blocks of code can be reached by the keyboard.
  const body = marked.parse(readFileSync(join(repository, "README.md"), "utf8")).replaceAll("<pre>", '<pre tabindex="0">');
  const page = join(repository, "target", "readme.html");
  writeFileSync(page, `<!doctype html><html lang="en"><head><meta charset="utf-8"><title>README</title>
<base href="../"><meta name="viewport" content="width=device-width"><style>${style}
body { margin: 0 } main { box-sizing: border-box; max-width: 980px; margin: 0 auto; padding: 24px }
pre { overflow: auto } .markdown-body main a { text-decoration: underline } @media (prefers-color-scheme: dark) { html { background: #0d1117 } }</style></head>
<body class="markdown-body"><main>${body}</main></body></html>`);
  return page;
}

/** Pages of the site that a reader opens: not those for printing, for browsers without scripts and of a server. */
function pages(folder) {
  return readdirSync(folder, { recursive: true })
    .filter((name) => name.endsWith(".html") && !["print.html", "toc.html", "404.html"].includes(name))
    .map((name) => join(folder, name));
}

const browser = await launched();
const faults = [];
const all = [await readme(), ...pages(site)];
if (screenshots) mkdirSync(screenshots, { recursive: true });
for (const width of [1280, 390]) {
  for (const theme of ["light", "dark"]) {
    let where = "";
    const fault = (text) => faults.push(`${where}: ${width} px, ${theme}: ${text}`);
    const page = await opened(browser, width, SCREENS[width], theme, fault);
    for (const file of all) {
      where = relative(repository, file);
      await page.goto(pathToFileURL(file).href);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      if (wide > width) fault(`${wide - width} px wider than the screen`);
      const absent = await page.evaluate(() => [...document.images].filter((image) => image.complete && !image.naturalWidth).map((image) => image.src));
      absent.forEach((source) => fault(`no picture ${source}`));
      if (screenshots) {
        const name = where.replaceAll("/", "_").replace(/\.html$/, "");
        await page.screenshot({ path: join(screenshots, `${name}-${width}-${theme}.png`) });
      }
      await checkAccess(page, fault);
    }
    await page.close();
  }
}
await browser.close();
end(faults, `${all.length} pages: no fault at 1280 and 390 px, light and dark`);
