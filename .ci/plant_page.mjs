// The plant's page in Chromium, as a person uses it: plant_page.mjs BROWSER PAGE LOOPS [SHOTS]. PAGE is the report of `drift fleet monitor --reports all` on so many loops.
import assert from "node:assert/strict";
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { start } from "./chromium.mjs";

const [program, html, count, shots] = process.argv.slice(2);
const LOOPS = Number(count);
const url = pathToFileURL(html).href;
const WIDE = { width: 1280, height: 900 }, NARROW = { width: 400, height: 850 };
if (shots) mkdirSync(shots, { recursive: true });

const ROWS = `[...document.querySelectorAll("#loops tbody tr")]`;
/** What stands in a column, from above: its sort key, else its text. */
const column = (page, at) => page.value(`${ROWS}.map((row) => row.cells[${at}].dataset.k ?? row.cells[${at}].textContent)`);
const shot = async (page, name) => { if (shots) writeFileSync(join(shots, `plant-${name}.png`), await page.screenshot()); };
const fits = async (page) => assert(await page.value("document.documentElement.scrollWidth <= innerWidth"), "wider than the window");
/** Nothing on the console, and nothing loaded but the pages that were opened. */
const quiet = (page, ...opened) => {
  assert.deepEqual(page.faults, []);
  assert.deepEqual(page.requests.filter((request) => !opened.includes(request) && !request.startsWith("data:")), []);
};

const checks = {
  /** Every column, by its button: falling at first, rising by the second click; every loop stays. */
  async "columns are sorted"(open) {
    const page = await open(url, WIDE);
    assert.equal(await page.value(`${ROWS}.length`), LOOPS);
    const ranked = (await column(page, 0)).join();
    await shot(page, "1280");
    const heads = await page.value(`[...document.querySelectorAll("#loops th")].map((head) => head.className)`);
    for (const [at, kind] of heads.entries()) {
      // A key that is a number is compared as one, whatever the column; an empty one lies below all.
      const isNumber = kind === "n" || (await page.value(`${ROWS}[0].cells[${at}].dataset.k !== undefined`));
      const order = (a, b) => isNumber ? (a === "" ? -Infinity : +a) - (b === "" ? -Infinity : +b) || 0 : a < b ? -1 : a > b ? 1 : 0;
      for (const rising of [false, true]) {
        await page.value(`document.querySelectorAll("#loops th button")[${at}].click()`);
        const values = await column(page, at);
        assert.equal(values.length, LOOPS);
        for (let i = 1; i < values.length; i++) {
          const step = order(values[i - 1], values[i]);
          assert(rising ? step <= 0 : step >= 0, `column ${at}: ${values[i - 1]} before ${values[i]}`);
        }
        assert.equal(await page.value(`document.querySelectorAll("#loops th")[${at}].getAttribute("aria-sort")`), rising ? "ascending" : "descending");
      }
    }
    assert.notEqual((await column(page, 0)).join(), ranked, "the order has changed");
    quiet(page, url);
  },

  /** By the keyboard alone: Tab to the search, a name, Tab to a column, Enter. */
  async "keyboard alone"(open) {
    const page = await open(url, WIDE);
    const reach = async (wanted) => {
      for (let i = 0; i < 20; i++) {
        await page.press("Tab");
        if (await page.value(`document.activeElement.matches(${JSON.stringify(wanted)})`)) return;
      }
      throw new Error(`no Tab leads to ${wanted}`);
    };
    await reach("#find");
    for (const letter of "-00003") await page.press(letter);
    await page.until(`${ROWS}.filter((row) => !row.hidden).length === 1 && document.querySelector("#left").textContent === "1 of ${LOOPS}"`, 5);
    await reach("#loops th button");
    await page.press("Enter");
    assert.equal(await page.value(`document.querySelector("#loops th").getAttribute("aria-sort")`), "descending");
    await reach("#loops td a");
    const aim = await page.value("document.activeElement.href");
    await page.press("Enter");
    await page.until(`location.href === ${JSON.stringify(aim)} && document.title.length > 0`, 20);
    quiet(page, url, aim);
  },

  /** Every link leads to the loop's own report, which says the loop's name and loads nothing. */
  async "links lead to each loop's report"(open) {
    const page = await open(url, WIDE);
    const links = await page.value(`[...document.querySelectorAll("#loops td a")].map((link) => [link.href, link.textContent])`);
    assert.equal(links.length, LOOPS);
    for (const [href, name] of links) {
      const report = await open(href, NARROW);
      assert((await report.value("document.body.textContent")).includes(name), `${href} does not say ${name}`);
      await fits(report);
      quiet(report, href);
      await report.shut();
    }
  },

  /** On a telephone's width and dark. */
  async "narrow and dark"(open) {
    const page = await open(url, { ...NARROW, dark: true });
    await fits(page);
    const [r, g, b] = (await page.value("getComputedStyle(document.body).backgroundColor")).match(/\d+/g).map(Number);
    assert(r + g + b < 200, `the ground is rgb(${r}, ${g}, ${b})`);
    const small = await page.value(`[...document.querySelectorAll("#loops svg")].every((picture) => picture.getBoundingClientRect().right <= innerWidth)`);
    assert(small, "a picture is cut off");
    await shot(page, "400-dark");
    quiet(page, url);
  },
};

const browser = await start(program);
let failed = 0;
for (const [name, check] of Object.entries(checks)) {
  try {
    await check((from, size) => browser.open(from, size));
    console.log(`plant page: ${name}: ok`);
  } catch (error) {
    failed += 1;
    console.log(`plant page: ${name}: ${error.message}`);
  }
}
await browser.close();
process.exit(failed ? 1 : 0);
