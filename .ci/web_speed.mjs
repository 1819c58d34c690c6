// How much longer the page's program takes than the command on one core: web_speed.mjs PAGE DRIFT FOLDER MOST_TIMES RECORDING LOOP.
// Both are run in turn, twice each, and the least processor time of each counts: a busy machine disturbs it least.
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { gunzipSync } from "node:zlib";
import { runInThisContext } from "node:vm";

const [html, drift, folder, most, recording, loop] = process.argv.slice(2);
const page = readFileSync(html, "utf8");
const script = (id) => page.split(`id="${id}">`)[1].split("</script>")[0];
const bytes = readFileSync(join(folder, recording));
Object.assign(globalThis, {
  driftPiece: (_, from, length) => new Uint8Array(bytes.subarray(from, from + length)),
  driftBegins() {}, driftStep() {}, driftPanics: (line) => console.log(line),
});
const glue = script("worker").split("// Runs the program beside the page")[0];
const program = runInThisContext(`${glue}; wasm_bindgen`);
program.initSync({ module: gunzipSync(Buffer.from(script("program"), "base64")) });
const question = JSON.stringify({
  recording: { number: 1, name: recording }, holdout: null, healthy: [], stated: [loop, readFileSync(join(folder, loop), "utf8")],
  asked: {}, command: ["drift"],
});
const here = () => {
  const begun = process.cpuUsage();
  program.diagnose(question);
  const { user, system } = process.cpuUsage(begun);
  return (user + system) / 1e6;
};
const native = () => {
  const line = ["-c", `"$@" > /dev/null; times`, "sh", drift, "diagnose", recording, "--loop", loop];
  const { stdout } = spawnSync("bash", line, { cwd: folder, env: { ...process.env, RAYON_NUM_THREADS: "1" }, encoding: "utf8" });
  const [user, system] = stdout.trim().split("\n")[1].split(" ").map((text) => { const [m, s] = text.split("m"); return 60 * m + Number.parseFloat(s); });
  return user + system;
};
const least = { here: Infinity, native: Infinity };
for (let turn = 0; turn < 2; turn++) {
  least.native = Math.min(least.native, native());
  least.here = Math.min(least.here, here());
}
const times = least.here / least.native;
const samples = bytes.toString().split("\n").length - 2;
console.log(`web: ${samples} samples diagnosed in ${least.here.toFixed(2)} s of processor time, ${times.toFixed(2)} times the command's ${least.native.toFixed(2)} s on one core`);
process.exit(times <= Number(most) ? 0 : 1);
