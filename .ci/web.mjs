// The checks of `.ci/web`: web.mjs BROWSER PAGE FOLDER DRIFT [SHOTS]. FOLDER holds recordings and loop files; the command DRIFT says what is right.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { start } from "./chromium.mjs";

const [program, html, folder, drift, shots] = process.argv.slice(2);
const url = pathToFileURL(html).href;
const at = (name) => join(folder, name);
const WIDE = { width: 1280, height: 900 }, NARROW = { width: 400, height: 850 };
const SECONDS = 300;
if (shots) mkdirSync(shots, { recursive: true });

const shown = (id) => `!document.getElementById("${id}").hidden`;
const text = (selector) => `document.querySelector(${JSON.stringify(selector)}).textContent`;
const click = (selector) => `document.querySelector(${JSON.stringify(selector)}).click()`;
const ENABLED = `!document.getElementById("diagnose").disabled`;

/** The same by the command: run in the folder, with the command line that the page states. */
const byCommand = (line) => {
  const words = line.split(" ").slice(1);
  execFileSync(drift, [...words, "--json", "answer.json", "--model", "answer.toml"], { cwd: folder, stdio: "ignore" });
  const read = (name) => readFileSync(at(name), "utf8");
  return { page: read("page.html"), model: read("answer.toml"), json: read("answer.json") };
};

const shot = async (page, name, whole) => { if (shots) writeFileSync(join(shots, `${name}.png`), await page.screenshot(whole)); };
const fits = async (page, what) => {
  const { scroll, inner } = await page.value("({ scroll: document.documentElement.scrollWidth, inner: innerWidth })");
  assert(scroll <= inner, `${what}: ${scroll} px wide of ${inner}`);
};
/** Nothing on the console, and nothing loaded but the page and what it holds. */
const quiet = (page) => {
  assert.deepEqual(page.faults, []);
  assert.deepEqual(page.requests.filter((request) => request !== url && !/^(blob|data):/.test(request)), []);
};

const checks = {
  /** One recording and a loop file, dropped: the command's page, loop file and JSON, to the byte. */
  async "one recording, dropped"(open) {
    const page = await open(WIDE);
    await page.value(click("[name=mode][value=one]"));
    await page.drop("#zone-now", [at("servo.csv")]);
    await page.drop("#known", [at("servo.toml")]);
    await page.until(ENABLED);
    await shot(page, "one-1280", true);
    await page.value(click("#diagnose"));
    await page.until(shown("work"), 5);
    await page.until(shown("answer"), SECONDS);
    await same(page, "drift diagnose servo.csv --loop servo.toml --report page.html");
    await page.until(text(".badge").concat(` === "Cause found"`), 20, page.framed);
    await page.framed(`document.querySelector("nav a").click()`);
    await page.until("scrollY > 300", 5, page.framed);
    await shot(page, "one-answer-1280");
    quiet(page);
  },
};

/** What the page saves equals what the command writes. */
async function same(page, command) {
  const right = byCommand(command);
  for (const part of ["page", "model", "json"]) {
    const ours = await page.download(`#save-${part}`);
    const theirs = part === "json" ? right.json.replace(/"model": "answer.toml"/, `"model": null`) : right[part].replace(" --json answer.json --model answer.toml", "");
    assert(ours === theirs, `${part}: ${difference(ours, theirs)}`);
  }
}

/** Where two texts first differ. */
function difference(ours, theirs) {
  let i = 0;
  while (i < ours.length && ours[i] === theirs[i]) i++;
  const around = (of) => JSON.stringify(of.slice(Math.max(0, i - 60), i + 60));
  return `at ${i} of ${theirs.length}: here ${around(ours)}, by the command ${around(theirs)}`;
}

const browser = await start(program);
let failed = 0;
for (const [name, check] of Object.entries(checks)) {
  const begun = Date.now(), pages = [];
  try {
    await check(async (size) => { const page = await browser.open(url, size); pages.push(page); return page; });
    console.log(`web: ${name}: ok, ${((Date.now() - begun) / 1000).toFixed(1)} s`);
  } catch (error) {
    failed += 1;
    console.log(`web: ${name}: ${error.message}`);
  }
  for (const page of pages) await page.shut();
}
await browser.close();
process.exit(failed ? 1 : 0);
