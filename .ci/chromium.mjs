// A browser that is driven through a pipe by the DevTools protocol: no library, no open port.
import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** Starts a browser without a window, with further options. */
export async function start(program, options = []) {
  const profile = mkdtempSync(join(tmpdir(), "drift-web-"));
  const child = spawn(program, ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
    "--no-first-run", "--remote-debugging-pipe", `--user-data-dir=${profile}`, ...options, "about:blank"],
  { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
  const calls = new Map(), listeners = [];
  let last = 0, unread = "";
  child.stdio[4].setEncoding("utf8").on("data", (text) => {
    const parts = (unread + text).split("\0");
    unread = parts.pop();
    for (const part of parts) {
      const said = JSON.parse(part);
      if (said.id === undefined) { for (const listener of listeners) listener(said); continue; }
      const { resolve, reject, method } = calls.get(said.id);
      calls.delete(said.id);
      if (said.error) reject(new Error(`${method}: ${said.error.message}`)); else resolve(said.result);
    }
  });
  const gone = new Promise((resolve) => child.once("exit", resolve));
  gone.then(() => { for (const { reject } of calls.values()) reject(new Error("the browser is gone")); });
  const call = (method, params = {}, sessionId = undefined) => new Promise((resolve, reject) => {
    const id = ++last;
    calls.set(id, { resolve, reject, method });
    child.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
  });
  const downloads = join(profile, "downloads");
  await call("Browser.setDownloadBehavior", { behavior: "allowAndName", downloadPath: downloads, eventsEnabled: true });
  const open = (url, size) => page({ call, listeners, downloads }, url, size);
  const close = async () => {
    await call("Browser.close").catch(() => {});
    await gone;
    rmSync(profile, { recursive: true, force: true });
  };
  /** Seconds of the processor that all of its processes have taken. */
  const seconds = async () => (await call("SystemInfo.getProcessInfo")).processInfo.reduce((sum, { cpuTime }) => sum + cpuTime, 0);
  return { open, close, seconds };
}

/** Opens a page of that size; `dark` is how it is asked to look. */
async function page({ call, listeners, downloads }, url, { width, height, dark = false }) {
  const { targetId } = await call("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await call("Target.attachToTarget", { targetId, flatten: true });
  const send = (method, params) => call(method, params, sessionId);
  const requests = [], faults = [];
  /** What is in the page: workers and frames that have a session of their own, by what they are. */
  const within = new Map();
  /** Where an expression is evaluated in the frame within the page: a session and a context in it. */
  let frame = [sessionId, undefined];
  listeners.push(({ method, params, sessionId: from }) => {
    if (from !== sessionId && !within.has(from)) return;
    if (method === "Runtime.executionContextCreated" && params.context.auxData?.isDefault && params.context.auxData.frameId !== targetId && within.get(from) !== "worker") {
      frame = [from, params.context.id];
    }
    if (method === "Network.requestWillBeSent") requests.push(params.request.url);
    if (method === "Runtime.exceptionThrown") faults.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === "Runtime.consoleAPICalled") faults.push(params.args.map((arg) => arg.value ?? arg.description).join(" "));
    if (method === "Log.entryAdded") faults.push(params.entry.text);
    // They are watched like the page itself.
    if (method === "Target.attachedToTarget") {
      const { sessionId: inner, targetInfo } = params;
      within.set(inner, targetInfo.type);
      for (const domain of ["Network", "Runtime", "Log"]) call(`${domain}.enable`, {}, inner).catch(() => {});
      call("Runtime.runIfWaitingForDebugger", {}, inner).catch(() => {});
    }
  });
  for (const domain of ["Page", "Network", "Runtime", "Log", "DOM"]) await send(`${domain}.enable`);
  await send("Target.setAutoAttach", { autoAttach: true, waitForDebuggerOnStart: true, flatten: true });
  await send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
  await send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
  const loaded = new Promise((resolve) => listeners.push(({ method, sessionId: from }) => { if (method === "Page.loadEventFired" && from === sessionId) resolve(); }));
  await send("Page.navigate", { url });
  await loaded;

  /** The value of an expression, in the page or in the frame within it. */
  const value = async (expression, [session, contextId] = [sessionId, undefined]) => {
    const { result, exceptionDetails } = await call("Runtime.evaluate", { expression, contextId, awaitPromise: true, returnByValue: true }, session);
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description ?? exceptionDetails.text}`);
    return result.value;
  };
  const framed = (expression) => value(expression, frame);
  /** Waits until it holds. */
  const until = async (expression, seconds = 60, where = value) => {
    for (const end = Date.now() + 1000 * seconds; Date.now() < end;) {
      if (await where(expression).catch(() => false)) return;
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    throw new Error(`after ${seconds} s it does not hold: ${expression}`);
  };
  /** Drags files over an element and drops them there, as from a folder's window. */
  const drop = async (selector, files) => {
    await value(`document.querySelector(${JSON.stringify(selector)}).scrollIntoView({ block: "center" })`);
    const place = await value(`(() => { const { x, y, width, height } = document.querySelector(${JSON.stringify(selector)}).getBoundingClientRect(); return { x: x + width / 2, y: y + Math.min(height / 2, 60) }; })()`);
    const data = { items: [], files, dragOperationsMask: 1 };
    for (const type of ["dragEnter", "dragOver", "drop"]) await send("Input.dispatchDragEvent", { type, ...place, data });
  };
  const KEYS = { Tab: 9, Enter: 13, " ": 32, ArrowDown: 40, ArrowUp: 38, ArrowRight: 39 };
  /** A key, down and up. */
  const press = async (key, modifiers = 0) => {
    const text = key === "Enter" ? "\r" : key.length === 1 ? key : undefined;
    const code = { key, code: key === " " ? "Space" : key, windowsVirtualKeyCode: KEYS[key] ?? key.toUpperCase().charCodeAt(0), modifiers };
    await send("Input.dispatchKeyEvent", { type: text ? "keyDown" : "rawKeyDown", text, ...code });
    await send("Input.dispatchKeyEvent", { type: "keyUp", ...code });
  };
  /** Chooses files in the dialog that an action opens; it has to be intercepted (`Page.setInterceptFileChooserDialog`). */
  const choosing = async (files, action) => {
    const opened = new Promise((resolve) => listeners.push(({ method, params }) => { if (method === "Page.fileChooserOpened") resolve(params); }));
    await action();
    await send("DOM.setFileInputFiles", { backendNodeId: (await opened).backendNodeId, files });
  };
  /** Clicks on a link and reads the file that the browser saves. */
  const download = async (selector) => {
    const done = new Promise((resolve) => listeners.push(({ method, params }) => {
      if (method === "Browser.downloadProgress" && params.state === "completed") resolve(params.guid);
    }));
    await value(`document.querySelector(${JSON.stringify(selector)}).click()`);
    return readFileSync(join(downloads, await done), "utf8");
  };
  const screenshot = async (whole = false) => {
    const { data } = await send("Page.captureScreenshot", { format: "png", captureBeyondViewport: whole });
    return Buffer.from(data, "base64");
  };
  const shut = () => call("Target.closeTarget", { targetId });
  return { value, framed, until, drop, press, choosing, download, screenshot, send, requests, faults, shut };
}
