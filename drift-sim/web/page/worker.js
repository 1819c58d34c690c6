// Runs the program beside the page, which stays alive. Above this stands what wasm-bindgen writes.
"use strict";
{
  /** Dropped files by their number. */
  const files = new Map();
  const reader = new FileReaderSync();
  let steps = 0, told = 0;

  /** A name that the program can call. */
  const give = (name, call) => { globalThis[name] = call; };

  give("driftPiece", (number, from, length) => {
    const file = files.get(number);
    try {
      return new Uint8Array(reader.readAsArrayBuffer(file.slice(from, from + length)));
    } catch {
      // It was changed, moved or removed since it was dropped.
      throw "the browser can no longer read it; drop it again";
    }
  });
  give("driftBegins", (stage, most) => { steps = 0; told = 0; postMessage({ stage, steps, most }); });
  give("driftStep", () => {
    steps += 1;
    const now = performance.now();
    if (now - told > 100) { told = now; postMessage({ steps }); }
  });
  give("driftPanics", (line) => postMessage({ panicked: line }));

  const unpacked = async (base64) => {
    const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  };
  let ready;

  addEventListener("message", async ({ data }) => {
    if (data.program !== undefined) {
      ready = unpacked(data.program).then((module) => wasm_bindgen({ module_or_path: module }));
      ready.catch((error) => postMessage({ broken: String(error) }));
      return;
    }
    await ready;
    for (const [number, file] of data.files) files.set(number, file);
    try {
      const said = wasm_bindgen[data.call](...data.values);
      postMessage({ number: data.number, said });
    } catch (error) {
      // A refusal is a line of text; all else is the end of the program.
      if (typeof error === "string") postMessage({ number: data.number, refused: error });
      else postMessage({ number: data.number, broken: String(error) });
    }
  });
}
