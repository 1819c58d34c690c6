// The checks of `.ci/web`: web.mjs BROWSER PAGE FOLDER DRIFT [SHOTS]. FOLDER holds recordings and loop files; the command DRIFT says what is right.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { closeSync, mkdirSync, openSync, readFileSync, rmSync, truncateSync, writeFileSync, writeSync } from "node:fs";
import { createServer } from "node:http";
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
  /** One recording and a loop file, dropped: the command's page, loop file and JSON. */
  async "one recording and a loop file, dropped"(open) {
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
    await page.until(`${text(".badge")} === "Cause found"`, 20, page.framed);
    await page.framed(click("nav a"));
    await page.until("scrollY > 300", 5, page.framed);
    await shot(page, "one-answer-1280");
    quiet(page);
  },

  /** Two recordings dropped together, on a telephone's width and dark: what changed? The page stays alive while it works. */
  async "two recordings, narrow and dark"(open) {
    const page = await open({ ...NARROW, dark: true });
    await fits(page, "at first");
    await shot(page, "first-400-dark", true);
    await page.drop("#zone-before", [at("healthy.csv"), at("worn.csv")]);
    await page.until(ENABLED);
    assert.equal(await page.value(text("#seen-before b")), "healthy.csv");
    await fits(page, "with two recordings");
    await shot(page, "two-400-dark", true);
    await page.value(`{ let last = performance.now(); globalThis.longest = 0;
      setInterval(() => { const now = performance.now(); longest = Math.max(longest, now - last); last = now; }, 10); }`);
    await page.value(click("#diagnose"));
    await page.until(`/\\d+ of \\d+, \\d+ s/.test(${text("#stage")})`, SECONDS);
    await shot(page, "work-400-dark");
    await page.until(shown("answer"), SECONDS);
    const longest = await page.value("longest");
    assert(longest < 1000, `the page stood still for ${longest} ms`);
    await same(page, "drift diagnose worn.csv --healthy healthy.csv --report page.html");
    await page.until(`${text(".badge")} === "Cause found"`, 20, page.framed);
    assert.equal(await page.framed("document.documentElement.scrollWidth <= innerWidth"), true);
    await shot(page, "two-answer-400-dark");
    quiet(page);
  },

  /** The example: usual names are guessed, what is asked reaches the reader, and a wrong word is the reader's line. */
  async "the example"(open) {
    const page = await open(WIDE);
    await shot(page, "first-1280", true);
    await page.value(click("#example"));
    await page.until(ENABLED);
    await page.until(`/y = 'PV'/.test(${text("#seen-before")}) && /y = 'PV'/.test(${text("#seen-now")})`);
    const say = (id, value) => page.value(`{ const field = document.getElementById("${id}"); field.value = "${value}"; field.dispatchEvent(new Event("change")); }`);
    await say("sample_time", "-1");
    await page.until(`${text("#seen-now .wrong")} === "sample time: '-1'; a number of seconds above 0"`);
    assert.equal(await page.value(ENABLED), false);
    await say("sample_time", "");
    await say("when", "OP<48");
    await page.until(`/% of the rows/.test(${text("#seen-now dl")}) && ${ENABLED}`);
    await shot(page, "example-1280", true);
    quiet(page);
  },

  /** From a server as from a disk; the server is asked for the page and for nothing else. */
  async "from a server"(open) {
    const asked = [];
    const server = createServer((request, response) => { asked.push(request.url); response.setHeader("content-type", "text/html").end(readFileSync(html)); });
    await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
    try {
      const page = await open(WIDE, `http://127.0.0.1:${server.address().port}/`);
      await page.drop("#zone-before", [at("healthy.csv")]);
      await page.until(`document.querySelector("#seen-before svg")`);
      assert.deepEqual(asked, ["/"]);
      assert.deepEqual(page.faults, []);
    } finally {
      server.close();
      server.closeAllConnections();
    }
  },

  /** Keyboard alone: the columns have names that nobody can guess, the loop file is proposed, the work is stopped and begun again. */
  async "keyboard alone"(open) {
    const page = await open(WIDE);
    await page.send("Page.setInterceptFileChooserDialog", { enabled: true });
    const focus = () => page.value(`(document.activeElement.dataset.signal ?? document.activeElement.id) || document.activeElement.value`);
    /** Tabs on until it is reached. */
    const reach = async (wanted) => {
      for (let i = 0; i < 60; i++) {
        if ((await focus()) === wanted) return;
        await page.press("Tab");
      }
      throw new Error(`no Tab leads to ${wanted}`);
    };
    await reach("two");
    await page.press("ArrowDown");
    assert.equal(await page.value(`document.querySelector("[name=mode]:checked").value`), "one");
    await reach("file-now");
    await page.choosing([at("unnamed.csv")], () => page.press("Enter"));
    await page.until(`/No column is called like y or u/.test(${text("#seen-now")})`);
    await shot(page, "columns-1280", true);
    assert.equal(await page.value(ENABLED), false);
    for (const [signal, column] of [["r", "a"], ["y", "b"], ["u", "c"]]) {
      await reach(signal);
      await page.press(column);
      await page.until(`document.querySelector("[data-signal=${signal}]").selectedOptions[0].textContent === "${column}"`);
    }
    await page.until(ENABLED);
    await reach("nothing");
    await page.press("ArrowDown");
    await reach("propose");
    await page.press("Enter");
    await page.until(`document.getElementById("loop").value.includes("[plant]")`, SECONDS);
    const toml = await page.value(`document.getElementById("loop").value`);
    execFileSync(drift, ["init", "unnamed.csv", "--columns", "r=a,y=b,u=c", "-o", "proposed.toml"], { cwd: folder, stdio: "ignore" });
    assert.equal(toml, readFileSync(at("proposed.toml"), "utf8"));
    await shot(page, "proposed-1280", true);
    await page.until(ENABLED);
    await reach("diagnose");
    await page.press("Enter");
    await page.until(shown("work"), 5);
    await reach("stop");
    await page.press("Enter");
    await page.until(`${text("#wrong")} === "Stopped." && ${ENABLED}`, 5);
    assert.equal(await focus(), "diagnose");
    await page.press("Enter");
    await page.until(shown("answer"), SECONDS);
    quiet(page);
  },

  /** Whatever is dropped, the page says one line and goes on; names are text. */
  async "strange files"(open) {
    const page = await open(WIDE);
    await page.value(click("[name=mode][value=one]"));
    const noise = Buffer.from(Array.from({ length: 5000 }, (_, i) => (i * i * 31 + i * 7) & 255));
    const rows = Array.from({ length: 300 }, (_, i) => `${i},1,nan,${i % 7}\n`).join("");
    for (const [name, content, line] of [
      ["<img src=x onerror=alert(1)>.csv", "", /the file is empty/],
      ["noise.csv", noise, /./],
      ["picture.png", Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), noise]), /./],
      ["broken.mat", Buffer.concat([Buffer.from("MATLAB 5.0 MAT-file".padEnd(124)), Buffer.from([0, 1, 73, 77]), noise]), /./],
      ["broken.csv.gz", Buffer.concat([Buffer.from([31, 139, 8, 0]), noise]), /./],
      ["no_u.csv", "time,SP,PV\n0,1,1\n1,1,1\n", /u/],
      ["one_row.csv", "t,r,y,u\n0,1,1,1\n", /one row of data only/],
    ]) {
      writeFileSync(at(name), content);
      await page.drop("#zone-now", [at(name)]);
      await page.until(`document.querySelector("#seen-now b")?.textContent === ${JSON.stringify(name)} && document.querySelector("#seen-now .wrong")`, 20);
      assert.match(await page.value(text("#seen-now .wrong")), line, name);
      assert.equal(await page.value(`document.querySelector("#seen-now img")`), null);
      assert.equal(await page.value(ENABLED), false, name);
    }
    // Not one number of y: what was read is shown, and the diagnosis is a line.
    writeFileSync(at("all_nan.csv"), "t,r,y,u\n" + rows);
    await page.drop("#zone-now", [at("all_nan.csv")]);
    await page.until(`${text("#seen-now b")} === "all_nan.csv" && (${ENABLED} || document.querySelector("#seen-now .wrong"))`, 20);
    if (await page.value(ENABLED)) {
      await page.value(click("#diagnose"));
      await page.until(`${text("#wrong")}.startsWith("all_nan.csv: ")`, 30);
    }
    // The page is as good as new.
    await page.drop("#zone-now", [at("servo.csv")]);
    await page.until(ENABLED, 20);
    quiet(page);
  },

  /** What can't be read is one line, the command's; what is too large is refused, what is large is read. */
  async "bad, huge and large files"(open) {
    const page = await open(NARROW);
    await page.value(click("[name=mode][value=one]"));
    writeFileSync(at("bad.csv"), "t,r,y,u\n0,1,1,1\n1,1,<img src=x onerror=alert(1)>,1\n");
    await page.drop("#zone-now", [at("bad.csv")]);
    await page.until(`${text("#seen-now .wrong")}.startsWith("bad.csv:3: ")`);
    assert.equal(await page.value(`document.querySelector("#seen-now img")`), null);
    await fits(page, "with an error");
    await shot(page, "bad-400", true);
    // Another column is y: said in words, as no column can be chosen of a file that can't be read.
    await page.value(`{ const field = document.getElementById("columns_said"); field.value = "y=u"; field.dispatchEvent(new Event("change")); }`);
    await page.until(`document.querySelector("#seen-now dl")`);
    await page.value(`document.getElementById("columns_said").value = ""`);
    writeFileSync(at("huge.csv"), "");
    truncateSync(at("huge.csv"), 300_000_001);
    await page.drop("#zone-now", [at("huge.csv")]);
    await page.until(`/at most 300 MB/.test(${text("#seen-now .wrong")})`, 10);
    // 100 MB of rows.
    const rows = Array.from({ length: 50_000 }, (_, i) => `${(i % 100) / 10},${(Math.sin(i) * 9).toFixed(12)},${Math.cos(i).toFixed(14)}\n`).join("");
    const file = openSync(at("large.csv"), "w");
    writeSync(file, "r,y,u\n");
    for (let written = 0; written < 100e6; written += rows.length) writeSync(file, rows);
    closeSync(file);
    await page.value(`document.getElementById("sample_time").value = "0.5"`);
    await page.drop("#zone-now", [at("large.csv")]);
    await page.until(`/takes minutes/.test(${text("#seen-now")}) && document.querySelector("#seen-now svg")`, SECONDS);
    await page.until(ENABLED, 5);
    rmSync(at("huge.csv"));
    rmSync(at("large.csv"));
    quiet(page);
  },
};

/**
 * What the page saves equals what the command writes: every word, and every number to five digits or to the last that is printed. The C library of the command's machine and the browser's code round some functions
 * apart, which moves where a fit ends by parts in 1e11.
 */
async function same(page, command) {
  const right = byCommand(command);
  for (const part of ["page", "model", "json"]) {
    let ours = await page.download(`#save-${part}`);
    let theirs = part === "json" ? right.json.replace(/"model": "answer.toml"/, `"model": null`) : right[part].replace(" --json answer.json --model answer.toml", "");
    if (part === "json") [ours, theirs] = [ours, theirs].map(withGainsInThousandths);
    const far = farthest(ours, theirs);
    assert(far === null, `${part}: ${far}`);
  }
}

/** Gains of rivals and candidates, which may be next to nothing, in thousandths. */
function withGainsInThousandths(json) {
  const document = JSON.parse(json);
  for (const cause of [...document.rivals, ...document.candidates]) cause.gain = cause.gain.toFixed(3);
  return JSON.stringify(document);
}

const NUMBER = /-?\d+(?:\.\d+)?(?:e[-+]?\d+)?/g;
/** Relative distance of numbers that count as one, beside one step of the last digit that is printed. */
const RELATIVE = 1e-5;

/** Null where two texts say the same; else where they first don't. */
function farthest(ours, theirs) {
  const [bareOurs, bareTheirs] = [ours, theirs].map((text) => text.replace(NUMBER, "#"));
  if (bareOurs !== bareTheirs) return difference(bareOurs, bareTheirs);
  const [a, b] = [ours, theirs].map((text) => text.match(NUMBER) ?? []);
  const near = (x, y) => Math.abs(x - y) <= 1.01 * Math.max(lastDigit(x), lastDigit(y)) + RELATIVE * Math.max(Math.abs(x), Math.abs(y));
  const at = a.findIndex((x, i) => x !== b[i] && !near(x, b[i]));
  return at < 0 ? null : `number ${at} of ${b.length}: here ${a[at]}, by the command ${b[at]}`;
}

/** What one step of the last digit after the point is worth; nothing of whole numbers. */
function lastDigit(number) {
  const [, decimals, exponent] = number.match(/\.(\d+)(?:e([-+]?\d+))?/) ?? [];
  return decimals === undefined ? 0 : 10 ** (Number(exponent ?? 0) - decimals.length);
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
    await check(async (size, from = url) => { const page = await browser.open(from, size); pages.push(page); return page; });
    console.log(`web: ${name}: ok, ${((Date.now() - begun) / 1000).toFixed(1)} s`);
  } catch (error) {
    failed += 1;
    console.log(`web: ${name}: ${error.message}`);
  }
  for (const page of pages) await page.shut();
}
await browser.close();
process.exit(failed ? 1 : 0);
