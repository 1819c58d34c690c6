// The checks of `.ci/browser`, run at the end of a report page. No timers: they end before the page has loaded.
"use strict";
(async () => {
  const opened = performance.now(), failures = [];
  const check = (holds, what) => { if (!holds) failures.push(what); };
  const near = (a, b, span) => Math.abs(a - b) <= 1e-6 * span;
  // uPlot draws in microtasks.
  const settle = async () => { for (let i = 0; i < 20; i++) await null; };
  const { groups, plots } = driftReport;

  const drawn = (u) => {
    const { width, height } = u.ctx.canvas, colours = new Set();
    const copy = Object.assign(document.createElement("canvas"), { width, height });
    const reader = copy.getContext("2d", { willReadFrequently: true });
    reader.drawImage(u.ctx.canvas, 0, 0);
    const pixels = reader.getImageData(0, 0, width, height).data;
    let inked = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      if (pixels[i + 3] > 100) { inked++; colours.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]); }
    }
    return inked > 300 && colours.size > 5;
  };
  const shows = (group, low, high, what) => {
    const span = group.whole[1] - group.whole[0];
    for (const u of group.plots) {
      check(near(u.scales.x.min, low, span) && near(u.scales.x.max, high, span),
        `${what}: ${u.scales.x.min} to ${u.scales.x.max}, not ${low} to ${high}`);
    }
  };
  const press = (figure, key) => figure.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
  const mouse = (target, type, x, y, more) => {
    const { left, top } = target.getBoundingClientRect();
    target.dispatchEvent(new MouseEvent(type, { clientX: left + x, clientY: top + y, bubbles: true, button: 0, movementX: 1, ...more }));
  };

  const figures = [...document.querySelectorAll("figure.chart")];
  check(opened < 2000, `it took ${opened} ms to open`);
  check(figures.length >= 2, `${figures.length} figures`);
  // The first screen: status, sentence, three numbers and the picture that proves it, without scrolling.
  const proof = [...document.querySelectorAll(".proof svg.plot")].filter((svg) => svg.getBoundingClientRect().height > 0);
  check(proof.length === 1, `${proof.length} pictures on the first screen`);
  check(proof[0].getBoundingClientRect().bottom + scrollY <= 850, `the first screen ends at ${proof[0].getBoundingClientRect().bottom} px`);
  check(document.querySelectorAll(".three li").length === 3, "not three numbers");
  check(["Healthy", "Suspect", "Drift", "Cause found", "Can't tell", "Told apart", "In part", "Learnt"].includes(document.querySelector(".badge").textContent), "no status");
  check(figures.every((f) => f.querySelectorAll("canvas").length > 0), "a figure without a chart");
  plots.forEach(({ u }, i) => check(drawn(u), `plot ${i} is empty`));
  check(performance.getEntriesByType("resource").length === 0, "something was loaded");
  check(globalThis.injected === undefined && !document.querySelector("img"), "text became markup");
  check(document.body.textContent.includes("<\/script>"), "the column's name is not on the page");
  check(document.documentElement.scrollWidth <= innerWidth, `${document.documentElement.scrollWidth} px wide of ${innerWidth}`);
  const ground = getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number);
  check((ground[0] < 128) === matchMedia("(prefers-color-scheme: dark)").matches, "the page is not as dark as asked for");

  // The signals are linked, over more than one figure where the page has two over their time.
  const isError = (u) => u.root.closest("[role=img]").getAttribute("aria-label").startsWith("e = ");
  const group = [...groups.values()].find((g) => g.plots.some(isError));
  const figure = group.plots[0].root.closest("figure"), [first, last] = group.whole, span = last - first;
  check(group.plots.length >= 3, `${group.plots.length} linked plots`);
  shows(group, first, last, "at first");
  const yBefore = group.plots.map((u) => u.scales.y.max - u.scales.y.min);

  press(figure, "+");
  await settle();
  const middle = (first + last) / 2, half = span / 3.2;
  shows(group, middle - half, middle + half, "after +");
  press(figure, "ArrowRight");
  await settle();
  shows(group, middle - half + half / 2, middle + half + half / 2, "after the right arrow");
  press(figure, "0");
  await settle();
  shows(group, first, last, "after 0");

  // A drag over the second quarter of the last linked plot.
  const { over } = group.plots.at(-1), width = over.clientWidth;
  mouse(over, "mousemove", width / 4, 30);
  mouse(over, "mousedown", width / 4, 30);
  mouse(over, "mousemove", width / 2, 30);
  mouse(over, "mouseup", width / 2, 30);
  await settle();
  const [low, high] = group.now;
  check(Math.abs(low - (first + span / 4)) < 0.02 * span && Math.abs(high - middle) < 0.02 * span, `a drag shows ${low} to ${high}`);
  shows(group, low, high, "after a drag");
  check(group.plots.some((u, i) => u.scales.y.max - u.scales.y.min < yBefore[i]), "no y fits what is in view");
  mouse(over, "dblclick", width / 2, 30);
  await settle();
  shows(group, first, last, "after a double click");

  mouse(over, "mousemove", width / 3, 30);
  await settle();
  const values = [...document.querySelectorAll(".value")].filter((place) => place.textContent);
  check(values.length >= 3, `${values.length} values under the cursor`);

  dispatchEvent(new Event("beforeprint"));
  await settle();
  check([...document.querySelectorAll("details")].every((d) => d.open), "something stays folded in print");
  check(getComputedStyle(document.body).backgroundColor === "rgb(255, 255, 255)", "paper is not white");
  // In print the still pictures stand for the charts: one each, with all that it shows, of the paper's width.
  const stills = [...document.querySelectorAll(".chart .still > svg")];
  check(stills.length === figures.length, `${stills.length} still pictures of ${figures.length} charts`);
  check(stills.every((svg) => svg.querySelectorAll("path.s, path.p, rect.b, path.b").length > 0), "a still picture is empty");
  check(stills.every((svg) => svg.querySelector("title").textContent && svg.querySelector("desc").textContent), "a picture says nothing");
  // Nothing is cut off at the edge of a sheet of A4: what holds in print holds here for a moment.
  const inPrint = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]).filter((rule) => rule.media?.mediaText === "print");
  const sheet = document.createElement("style");
  sheet.textContent = [...inPrint.flatMap((rule) => [...rule.cssRules]).map((rule) => rule.cssText), "body { width: 186mm }"].join("\n");
  document.head.append(sheet);
  const edge = document.body.getBoundingClientRect().right + 1;
  const cut = [...document.querySelectorAll("table")].filter((table) => table.getBoundingClientRect().right > edge);
  check(inPrint.length > 0 && cut.length === 0, `${cut.length} tables are cut off in print`);
  sheet.remove();
  dispatchEvent(new Event("afterprint"));
  await settle();

  const pre = document.createElement("pre");
  pre.id = "checks";
  pre.textContent = failures.length ? failures.join("; ") : `ok, ${plots.length} charts, ${Math.round(opened)} ms`;
  document.body.append(pre);
})();
