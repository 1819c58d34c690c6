// How much longer the page takes in Chromium than the command on one core: web_speed.mjs BROWSER PAGE DRIFT MOST_TIMES RECORDING LOOP.
// The recording and the loop file are dropped and diagnosed as a person does it. Time is the processor's, which a busy machine disturbs least; the page's is
// that of all the browser's processes, from the click to the answer.
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { basename } from "node:path";
import { pathToFileURL } from "node:url";
import { start } from "./chromium.mjs";

const [program, html, drift, most, recording, loop] = process.argv.slice(2);
const SECONDS = 600;
const seconds = (text) => { const [m, s] = text.split("m"); return 60 * m + Number.parseFloat(s); };

/** Seconds of the processor and of the clock by the command. */
const native = () => {
  const begun = performance.now();
  const line = ["-c", `"$@" > /dev/null; code=$?; times; exit $code`, "sh", drift, "diagnose", recording, "--loop", loop];
  const { stdout, stderr, status } = spawnSync("bash", line, { env: { ...process.env, RAYON_NUM_THREADS: "1" }, encoding: "utf8" });
  if (status !== 0) throw new Error(stderr);
  const [user, system] = stdout.trim().split("\n")[1].split(" ").map(seconds);
  return { used: user + system, waited: (performance.now() - begun) / 1000 };
};

const browser = await start(program);
/** The same by the page. */
const here = async () => {
  const page = await browser.open(pathToFileURL(html).href, { width: 1280, height: 900 });
  await page.value(`document.querySelector("[name=mode][value=one]").click()`);
  await page.drop("#zone-now", [recording]);
  await page.drop("#known", [loop]);
  await page.until(`!document.getElementById("diagnose").disabled`);
  const [before, begun] = [await browser.seconds(), performance.now()];
  await page.value(`document.getElementById("diagnose").click()`);
  await page.until(`!document.getElementById("answer").hidden`, SECONDS);
  const spent = { used: await browser.seconds() - before, waited: (performance.now() - begun) / 1000 };
  await page.shut();
  return spent;
};

const command = native();
const answered = await here();
await browser.close();
const times = answered.used / command.used;
const samples = readFileSync(recording, "utf8").trim().split("\n").length - 1;
const told = ({ used, waited }) => `${used.toFixed(1)} s of the processor (${waited.toFixed(1)} s of the clock)`;
console.log(`web: ${basename(recording)}, ${samples} samples: Chromium ${told(answered)}, the command on one core ${told(command)}: ${times.toFixed(2)} times; at most ${most}`);
process.exit(times <= Number(most) ? 0 : 1);
