// The page: what was dropped, what is asked, and the answer. The work is done by the worker.
"use strict";
(() => {
  const find = (id) => document.getElementById(id);
  const make = (tag, parent, properties = {}) => {
    const made = Object.assign(document.createElement(tag), properties);
    parent?.append(made);
    return made;
  };
  /** Bytes of a recording that are read here; the program's memory is a browser's. */
  const LARGEST = 300e6, LARGEST_LOOP = 10e6;
  /** From here on a diagnosis takes longer than one waits for. */
  const MANY_ROWS = 150_000;
  const SIGNALS = [["t", "time"], ["r", "set-point"], ["y", "measured"], ["u", "controller output"]];
  const megabytes = (bytes) => `${Math.round(bytes / 1e6)} MB`;

  // ---- The program in its worker.

  const program = {
    worker: null, calls: new Map(), last: 0, hears: () => {}, panicked: "",

    /** Begins to load it, which takes a moment. */
    begin() {
      const code = new Blob([find("worker").textContent], { type: "text/javascript" });
      const url = URL.createObjectURL(code);
      this.worker = new Worker(url);
      this.worker.addEventListener("message", ({ data }) => this.told(data));
      this.worker.addEventListener("error", (event) => this.end(`This browser can't run it: ${event.message || "no worker"}`));
      this.worker.postMessage({ program: find("program").textContent });
    },

    told(data) {
      if (data.panicked !== undefined) { this.panicked = data.panicked; return; }
      if (data.steps !== undefined) { this.hears(data); return; }
      const call = this.calls.get(data.number);
      if (data.broken !== undefined) {
        const why = /memory|allocat/i.test(this.panicked + data.broken) || !this.panicked
          ? "The browser's memory did not suffice. Take a part of the recording, or the command drift."
          : `This should not happen; please report it: ${this.panicked}`;
        this.end(call ? why : `This browser can't run it (it is too old, or forbids WebAssembly): ${data.broken}`);
        return;
      }
      this.calls.delete(data.number);
      if (data.refused !== undefined) call?.reject(new Error(data.refused));
      else call?.resolve(JSON.parse(data.said));
    },

    /** Calls it; `files` are those that it may read. Progress goes to `hears`. */
    call(name, values, files, hears = this.hears) {
      if (!this.worker) this.begin();
      const number = ++this.last;
      return new Promise((resolve, reject) => {
        this.calls.set(number, { resolve, reject });
        this.hears = hears;
        this.worker.postMessage({ number, call: name, values, files: files.map((file) => [file.number, file.file]) });
      });
    },

    /** Ends all that runs; the next call begins anew, with fresh memory. */
    end(why) {
      this.worker?.terminate();
      const calls = [...this.calls.values()];
      Object.assign(this, { worker: null, calls: new Map(), panicked: "" });
      for (const call of calls) call.reject(new Error(why));
      if (!calls.length && why) wrong(why);
    },
  };

  // ---- What was dropped and what is asked.

  const places = Object.fromEntries(["before", "now"].map((place) => [place, {
    place, zone: find(`zone-${place}`), input: find(`file-${place}`), shown: find(`seen-${place}`), file: null, seen: null, error: "",
  }]));
  const state = { columns: {}, files: 0, loop_name: "loop.toml", busy: false, looking: 0 };
  const isComparing = () => find("mode").querySelector(":checked").value === "two";
  const isStated = () => find("known").querySelector(":checked").value === "stated";
  const used = () => (isComparing() ? [places.before, places.now] : [places.now]);
  const loaded = () => used().filter((place) => place.file);

  const written = (name, names) => (/[,="+]/.test(name) ? String(names.indexOf(name) + 1) : name);
  const asked = () => {
    const names = loaded().find((place) => place.seen)?.seen.names ?? [];
    const value = (id) => find(id).value.trim();
    const chosen = SIGNALS.map(([letter]) => letter).filter((letter) => letter in state.columns)
      .map((letter) => `${letter}=${written(state.columns[letter], names)}`).join(",");
    const columns = value("columns_said") || chosen;
    const when = value("when") ? [value("when")] : [];
    return { columns, sample_time: value("sample_time"), resample: value("resample"), when, repeated: value("repeated"), dates: value("dates") };
  };
  /** The same as the command's options. */
  const options = () => {
    const { columns, sample_time, resample, when, repeated, dates } = asked();
    const pairs = [["--columns", columns], ["--sample-time", sample_time], ["--resample", resample], ["--when", when[0]], ["--repeated", repeated], ["--dates", dates]];
    return pairs.filter(([, value]) => value).flat();
  };

  const wrong = (line) => {
    find("wrong").textContent = line ?? "";
    find("wrong").hidden = !line;
  };

  const take = (place, file) => {
    const refused = file.size > LARGEST
      ? `${file.name} has ${megabytes(file.size)}, and this page reads at most ${megabytes(LARGEST)}: take a part of it, or the command drift, which reads any length.`
      : "";
    const number = ++state.files;
    Object.assign(place, { file: refused ? null : { number, file, name: file.name }, seen: null, error: refused });
    place.input.value = "";
    look(place);
  };

  /** Looks at a recording anew; whatever was asked before is out of date. */
  const look = async (place) => {
    const turn = (place.turn = (place.turn ?? 0) + 1);
    if (!place.file) { show(place); return; }
    place.seen = null;
    place.error = "";
    place.reading = true;
    show(place);
    let seen = null, error = "";
    try {
      seen = await program.call("look", [place.file.number, place.file.name, JSON.stringify(asked())], [place.file]);
    } catch (refused) {
      error = refused.message;
    }
    if (turn !== place.turn) return;
    Object.assign(place, { seen, error, reading: false });
    show(place);
  };
  const lookAgain = () => { for (const place of loaded()) look(place); };

  // ---- How it is shown.

  const show = (place) => {
    const { shown, seen, file } = place;
    shown.replaceChildren();
    place.zone.classList.toggle("full", !!file);
    if (file) make("p", shown).append(make("b", null, { textContent: file.name }));
    place.input.parentElement.firstChild.data = file ? "Choose another" : "Choose a file";
    if (place.reading) make("p", shown, { className: "note", textContent: "Reading …" });
    if (place.error) make("p", shown, { className: "line wrong", textContent: place.error, role: "alert" });
    if (seen) {
      if (seen.picture) make("div", shown, { innerHTML: seen.picture });
      const list = make("dl", shown);
      for (const [name, text] of seen.facts) { make("dt", list, { textContent: name }); make("dd", list, { textContent: text }); }
      for (const note of seen.notes) make("p", shown, { className: "note", textContent: note });
      if (seen.rows > MANY_ROWS) make("p", shown, { className: "note", textContent: `A diagnosis of ${seen.rows} rows takes minutes here; it can be stopped. A part of the recording in which much happens tells as much.` });
      const open = ["y", "u"].filter((letter) => !seen.columns[letter]);
      const lacks = seen.lacks ? `No column is called like ${open.join(" or ")}: choose ${open.length > 1 ? "them" : "it"} below.` : seen.uneven;
      if (lacks) make("p", shown, { className: "line wrong soft", textContent: lacks });
      if (!seen.lacks && seen.uneven && seen.step) {
        const grid = make("button", shown, { type: "button", textContent: `Put the rows on a grid of ${seen.step} s` });
        grid.addEventListener("click", () => { find("resample").value = seen.step; find("more").open = true; lookAgain(); });
      }
    }
    showColumns();
    ready();
  };

  /** A choice for each signal; what is not touched stays guessed, for each recording by itself. */
  const showColumns = () => {
    const seen = loaded().map((place) => place.seen).find((seen) => seen);
    find("reading").hidden = loaded().length === 0;
    if (!seen) return;
    const focused = document.activeElement?.dataset?.signal;
    const fields = find("columns");
    fields.replaceChildren();
    for (const [letter, what] of SIGNALS) {
      const label = make("label", fields, { textContent: `${letter}, ${what}` });
      const select = make("select", label);
      select.dataset.signal = letter;
      const guessed = seen.columns[letter];
      const said = state.columns[letter];
      if (said === undefined) make("option", select, { value: "guess", textContent: guessed ? `${guessed} (guessed)` : letter === "r" ? "not recorded" : letter === "t" ? "no time stamps" : "choose one" });
      else make("option", select, { value: "guess", textContent: "guess it" });
      if (letter === "t" && (said !== undefined || guessed)) make("option", select, { value: "none", textContent: "no time stamps" });
      if (letter === "r" && (said !== undefined || guessed)) make("option", select, { value: "none", textContent: "not recorded" });
      seen.names.forEach((name, i) => { if (name) make("option", select, { value: `c${i}`, textContent: name }); });
      select.value = said === undefined ? "guess" : said === "" ? "none" : `c${seen.names.indexOf(said)}`;
      select.addEventListener("change", () => {
        find("columns_said").value = "";
        if (select.value === "guess") delete state.columns[letter];
        else state.columns[letter] = select.value === "none" ? "" : seen.names[Number(select.value.slice(1))];
        if (letter === "t" && select.value === "none" && !find("sample_time").value) find("more").open = true;
        lookAgain();
      });
    }
    if (focused) fields.querySelector(`[data-signal=${focused}]`).focus();
  };

  /** What is still needed before it can be diagnosed. */
  const ready = () => {
    const missing = used().filter((place) => !place.file).map((place) => (!isComparing() ? "a recording" : place === places.before ? "a recording of then" : "a recording of now"));
    const faulty = loaded().find((place) => place.error || place.seen?.lacks || place.seen?.uneven);
    const lacks = missing.length ? `Still needed: ${missing.join(" and ")}.`
      : faulty ? `${faulty.file.name} can't be read like this yet.`
      : used().some((place) => place.reading) ? "Reading …"
      : isStated() && !find("loop").value.trim() ? "Still needed: the loop file." : "";
    find("lacks").textContent = state.busy ? "" : lacks;
    find("diagnose").disabled = state.busy || !!lacks;
    find("swap").hidden = !isComparing() || loaded().length === 0;
    find("example").hidden = find("example-note").hidden = loaded().length > 0;
    find("propose").disabled = state.busy || !loaded().some((place) => place.seen && !place.seen.lacks && !place.seen.uneven);
    find("stated").hidden = !isStated();
  };

  const arrange = () => {
    places.before.zone.hidden = !isComparing();
    places.now.zone.parentElement.classList.toggle("alone", !isComparing());
    places.now.zone.querySelector("h3").textContent = isComparing() ? "Now" : "The recording";
    find("title").textContent = isComparing() ? "What changed in this control loop?" : "What is missing in the model of this loop?";
    showColumns();
    ready();
  };

  // ---- Dropping and choosing.

  const isLoopFile = (file) => /\.toml$/i.test(file.name);
  const takeLoop = async (file) => {
    if (file.size > LARGEST_LOOP) { wrong(`${file.name} is too large for a loop file.`); return; }
    find("known").querySelector("[value=stated]").checked = true;
    state.loop_name = file.name;
    find("loop").value = await file.text();
    find("loop-note").textContent = `${file.name}, as you have it; changes here stay on this page.`;
    ready();
  };
  const takeAll = (files, aimed) => {
    wrong();
    const recordings = files.filter((file) => !isLoopFile(file));
    const loopFile = files.find(isLoopFile);
    if (loopFile) takeLoop(loopFile);
    if (recordings.length > 2) wrong(`${recordings.length} recordings were dropped; the first two are taken.`);
    if (recordings.length > 1) {
      find("mode").querySelector("[value=two]").checked = true;
      arrange();
      // The older one shows the loop as it was.
      const [before, now] = recordings.slice(0, 2).sort((a, b) => a.lastModified - b.lastModified);
      take(places.before, before);
      take(places.now, now);
    } else if (recordings.length === 1) {
      take(aimed ?? used().find((place) => !place.file) ?? places.now, recordings[0]);
    }
  };
  const zoneOf = (target) => used().find((place) => place.zone.contains(target));
  const aim = (event) => {
    document.body.classList.toggle("over", event !== null);
    for (const place of used()) place.zone.classList.toggle("aim", !!event && place.zone.contains(event.target));
  };
  addEventListener("dragover", (event) => { event.preventDefault(); event.dataTransfer.dropEffect = "copy"; aim(event); });
  addEventListener("dragleave", (event) => { if (!event.relatedTarget) aim(null); });
  addEventListener("drop", (event) => {
    event.preventDefault();
    aim(null);
    if (!state.busy) takeAll([...event.dataTransfer.files], zoneOf(event.target));
  });
  for (const place of Object.values(places)) {
    place.input.addEventListener("change", () => { if (place.input.files.length) takeAll([...place.input.files], place); });
  }
  find("file-loop").addEventListener("change", ({ target }) => { if (target.files.length) takeLoop(target.files[0]); target.value = ""; });
  find("example").addEventListener("click", async () => {
    const made = await program.call("example", [], []).catch((refused) => wrong(refused.message));
    if (!made) return;
    const files = ["healthy", "worn"].map((name, i) => new File([made[name]], `${name}.csv`, { lastModified: i }));
    if (isComparing()) takeAll(files); else takeAll(files.slice(1));
  });
  find("swap").addEventListener("click", () => {
    const { before, now } = places;
    const kept = ({ file, seen, error, reading }) => ({ file, seen, error, reading });
    const [a, b] = [kept(before), kept(now)];
    // Answers that are under way belong to the other side now.
    const isReading = a.reading || b.reading;
    Object.assign(before, b);
    Object.assign(now, a);
    show(before);
    show(now);
    if (isReading) lookAgain();
  });
  find("mode").addEventListener("change", () => { arrange(); lookAgain(); });
  find("known").addEventListener("change", ready);
  find("loop").addEventListener("input", ready);
  for (const id of ["columns_said", "sample_time", "resample", "when", "repeated", "dates"]) find(id).addEventListener("change", lookAgain);

  // ---- Work, and the answer.

  /** Runs long work with a bar, a clock and a way to stop it; the button that began it has the focus again at its end. */
  const work = async (button, name, values, files) => {
    const begun = performance.now();
    let stage = "reading", steps = 0, most = 0;
    const tell = () => {
      const seconds = Math.floor((performance.now() - begun) / 1000);
      find("stage").textContent = `${stage}${most ? `, ${steps} of ${most}` : ""}, ${seconds} s`;
      if (most) Object.assign(find("bar"), { max: most, value: Math.min(steps, most) });
      else find("bar").removeAttribute("value");
    };
    const hears = (said) => {
      if (said.stage !== undefined) { stage = said.stage; most = said.most; }
      steps = said.steps;
      tell();
    };
    wrong();
    state.busy = true;
    find("work").hidden = false;
    tell();
    ready();
    const clock = setInterval(tell, 250);
    try {
      return await program.call(name, values, files, hears);
    } finally {
      clearInterval(clock);
      state.busy = false;
      find("work").hidden = true;
      ready();
      button.focus();
    }
  };
  find("stop").addEventListener("click", () => program.end("Stopped."));

  find("propose").addEventListener("click", async ({ currentTarget: button }) => {
    const place = loaded()[0];
    try {
      const said = await work(button, "propose", [place.file.number, place.file.name, JSON.stringify(asked())], [place.file]);
      state.loop_name = "loop.toml";
      find("loop").value = said.toml;
      find("loop-note").textContent = `Proposed from ${place.file.name}; the lines with # say how, and how sure it is. ${said.note ?? ""}`;
      find("loop").focus();
    } catch (refused) {
      wrong(refused.message);
    }
    ready();
  });

  const name_of = ({ file }) => ({ number: file.number, name: file.name });
  find("diagnose").addEventListener("click", async ({ currentTarget: button }) => {
    const { before, now } = places;
    const healthy = isComparing() ? [before] : [];
    const stated = isStated() ? [state.loop_name, find("loop").value] : null;
    const command = ["drift", "diagnose", now.file.name, ...healthy.flatMap((place) => ["--healthy", place.file.name]),
      ...(stated ? ["--loop", stated[0]] : []), ...options(), "--report", "page.html"];
    const question = { recording: name_of(now), holdout: null, healthy: healthy.map(name_of), stated, asked: asked(), command };
    try {
      present(await work(button, "diagnose", [JSON.stringify(question)], used().map((place) => place.file)), now.file.name);
    } catch (refused) {
      wrong(refused.message);
    }
  });

  let urls = [];
  const present = (said, name) => {
    urls.forEach(URL.revokeObjectURL);
    urls = [];
    const link = (text, type) => {
      const url = URL.createObjectURL(new Blob([text], { type }));
      urls.push(url);
      return url;
    };
    const stem = name.replace(/(\.csv)?\.gz$|\.[^.]*$/i, "");
    const page = link(said.page, "text/html;charset=utf-8");
    for (const [id, url, file] of [
      ["save-page", page, `${stem}.diagnosis.html`],
      ["save-model", link(said.model, "text/plain;charset=utf-8"), `${stem}.improved.toml`],
      ["save-json", link(said.json, "application/json"), `${stem}.diagnosis.json`],
    ]) Object.assign(find(id), { href: url, download: file });
    find("report").srcdoc = said.page;
    find("setup").hidden = true;
    find("answer").hidden = false;
    document.title = said.title;
    scrollTo(0, 0);
    find("report").focus();
  };
  // A link within the answer would lead to this page: a frame without an address of its own has its parent's.
  find("report").addEventListener("load", ({ currentTarget: { contentDocument: within } }) => within.addEventListener("click", (event) => {
    const place = event.target.closest("a")?.getAttribute("href")?.match(/^#(.+)/)?.[1];
    if (!place) return;
    event.preventDefault();
    within.getElementById(place)?.scrollIntoView();
  }));
  find("back").addEventListener("click", () => {
    find("answer").hidden = true;
    find("setup").hidden = false;
    find("report").removeAttribute("srcdoc");
    document.title = "drift: what changed in this loop?";
    find("diagnose").focus();
  });

  arrange();
  program.call("version", [], []).then((version) => { find("version").textContent = version; }, (refused) => wrong(refused.message));
})();
