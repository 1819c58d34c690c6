// Draws the figures of a report with uPlot. Figures that share an axis are zoomed and read together.
"use strict";
(() => {
  const LEFT = 92, DASH = [8, 5], LIMIT_DASH = [4, 4];
  // From here on the still pictures are for print alone.
  document.documentElement.classList.add("live");
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const groups = new Map();
  const plots = [];

  // Colours come from the style sheet, so that a dark page and print have their own.
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue("--" + name).trim();
  const shade = (name, percent) => `color-mix(in srgb, ${colour(name)} ${percent}%, transparent)`;

  const element = (tag, parent, properties = {}) => {
    const made = Object.assign(document.createElement(tag), properties);
    parent.append(made);
    return made;
  };

  const shown = (value) => {
    if (value == null || !Number.isFinite(value)) return "\u2013";
    const size = Math.abs(value);
    const text = size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(3) : String(+value.toPrecision(5));
    return text.replaceAll("-", "\u2212");
  };

  // Tick numbers with the digits that their distance needs.
  const ticks = (splits) => {
    const step = splits.length > 1 ? Math.abs(splits[1] - splits[0]) : 1;
    const largest = Math.max(...splits.map(Math.abs));
    let decimals = 0;
    while (decimals < 9 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6 * step * 10 ** decimals) decimals++;
    const text = (value) => {
      if (Math.abs(value) < 1e-9 * step) return "0";
      if (largest < 1e6 && decimals <= 5) return value.toFixed(decimals);
      const digits = Math.floor(Math.log10(Math.abs(value)) + 1e-9) - Math.floor(Math.log10(step) + 1e-9);
      return value.toExponential(Math.min(12, Math.max(0, digits)));
    };
    return splits.map((value) => text(value).replaceAll("-", "\u2212"));
  };

  const xOf = (grid) =>
    Array.isArray(grid) ? grid : Array.from({ length: grid.count }, (_, i) => grid.start + i * grid.step);

  const widen = (range, value) => {
    if (value < range[0]) range[0] = value;
    if (value > range[1]) range[1] = value;
  };

  // The range that a list of x and of marks spans, with some room around single points.
  const wholeRange = (panels, grids) => {
    const range = [Infinity, -Infinity], marks = [Infinity, -Infinity];
    let apart = false;
    for (const layer of panels.flatMap((panel) => panel.layers)) {
      if (layer.grid !== undefined) {
        const x = grids[layer.grid];
        if (x.length) { widen(range, x[0]); widen(range, x[x.length - 1]); }
      } else if (layer.x?.length) {
        apart = true;
        const half = layer.width ? layer.width / 2 : 0;
        for (const x of layer.x) { widen(range, x - half); widen(range, x + half); }
      } else if (layer.type === "span") { widen(marks, layer.from); widen(marks, layer.to); }
    }
    const wanted = panels.find((panel) => panel.x_range)?.x_range;
    if (wanted) return wanted;
    const [low, high] = range[0] <= range[1] ? range : marks[0] <= marks[1] ? marks : [0, 1];
    const room = high > low ? (apart ? 0.03 * (high - low) : 0) : Math.abs(low) || 1;
    return [low - room, high + room];
  };

  // Lines, then bands, as uPlot's aligned table.
  const table = (panel, grids) => {
    const lines = [], bands = [], byGrid = new Map();
    const add = (grid, values) => {
      if (!byGrid.has(grid)) byGrid.set(grid, [grids[grid]]);
      const columns = byGrid.get(grid);
      columns.push(values);
      return { grid, column: columns.length - 1 };
    };
    for (const layer of panel.layers) {
      if (layer.type === "band") bands.push({ layer, upper: add(layer.grid, layer.upper), lower: add(layer.grid, layer.lower) });
    }
    for (const layer of panel.layers) {
      if (layer.type === "line") lines.push({ layer, at: add(layer.grid, layer.y) });
    }
    const tables = [...byGrid.values()];
    const before = new Map();
    let offset = 0;
    for (const [grid, columns] of byGrid) { before.set(grid, offset); offset += columns.length - 1; }
    const index = (at) => before.get(at.grid) + at.column;
    const data = tables.length === 0 ? [[0, 1]] : tables.length === 1 ? tables[0] : uPlot.join(tables);
    return { data, lines: lines.map((l) => ({ ...l, index: index(l.at) })),
      bands: bands.map((b) => ({ layer: b.layer, upper: index(b.upper), lower: index(b.lower) })), count: offset };
  };

  // Shades that differ by pattern as well as by colour.
  const hatch = (name) => {
    const size = 8 * devicePixelRatio, tile = document.createElement("canvas");
    tile.width = tile.height = size;
    const ctx = tile.getContext("2d");
    ctx.fillStyle = shade(name, 16);
    ctx.fillRect(0, 0, size, size);
    ctx.strokeStyle = shade(name, 55);
    ctx.lineWidth = devicePixelRatio;
    ctx.beginPath();
    if (name === "yellow") { ctx.moveTo(0, size); ctx.lineTo(size, 0); }
    if (name === "orange") { ctx.moveTo(size / 2, 0); ctx.lineTo(size / 2, size); }
    ctx.stroke();
    return ctx.createPattern(tile, "repeat");
  };

  const clipped = (u, draw) => {
    const { left, top, width, height } = u.bbox;
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(left, top, width, height);
    u.ctx.clip();
    draw(u.ctx, devicePixelRatio);
    u.ctx.restore();
  };

  const drawBehind = (u, panel) => clipped(u, (ctx) => {
    for (const layer of panel.layers.filter((l) => l.type === "span")) {
      const from = u.valToPos(layer.from, "x", true), to = u.valToPos(layer.to, "x", true);
      ctx.fillStyle = hatch(layer.colour);
      ctx.fillRect(from, u.bbox.top, Math.max(to - from, 1), u.bbox.height);
    }
  });

  const drawFront = (u, panel) => clipped(u, (ctx, ratio) => {
    const { left, top, width, height } = u.bbox;
    const stroke = (layer, from, to) => {
      ctx.strokeStyle = colour(layer.colour);
      ctx.lineWidth = 1.5 * ratio;
      ctx.setLineDash(layer.dashed ? LIMIT_DASH.map((d) => d * ratio) : []);
      ctx.beginPath();
      ctx.moveTo(...from);
      ctx.lineTo(...to);
      ctx.stroke();
      ctx.setLineDash([]);
    };
    for (const layer of panel.layers) {
      if (layer.type === "horizontal") {
        const y = u.valToPos(layer.y, "y", true);
        stroke(layer, [left, y], [left + width, y]);
      } else if (layer.type === "vertical") {
        const x = u.valToPos(layer.x, "x", true);
        stroke(layer, [x, top], [x, top + height]);
      } else if (layer.type === "points") drawPoints(u, ctx, ratio, layer);
      else if (layer.type === "bars") drawBars(u, ctx, layer);
    }
  });

  const drawPoints = (u, ctx, ratio, layer) => {
    const { min, max } = u.scales.x;
    ctx.fillStyle = shade(layer.colour, 70);
    ctx.strokeStyle = colour(layer.colour);
    ctx.lineWidth = 1.5 * ratio;
    const arm = 3.5 * ratio;
    ctx.beginPath();
    for (let i = 0; i < layer.x.length; i++) {
      if (layer.x[i] < min || layer.x[i] > max) continue;
      const x = u.valToPos(layer.x[i], "x", true), y = u.valToPos(layer.y[i], "y", true);
      if (layer.marker === "cross") {
        ctx.moveTo(x - arm, y - arm); ctx.lineTo(x + arm, y + arm);
        ctx.moveTo(x - arm, y + arm); ctx.lineTo(x + arm, y - arm);
      } else {
        ctx.moveTo(x + 2.5 * ratio, y);
        ctx.arc(x, y, 2.5 * ratio, 0, 2 * Math.PI);
      }
    }
    if (layer.marker === "cross") ctx.stroke(); else ctx.fill();
  };

  const drawBars = (u, ctx, layer) => {
    ctx.fillStyle = shade(layer.colour, 85);
    const foot = u.valToPos(Math.max(0, u.scales.y.min), "y", true);
    for (let i = 0; i < layer.x.length; i++) {
      const from = u.valToPos(layer.x[i] - layer.width / 2, "x", true);
      const to = u.valToPos(layer.x[i] + layer.width / 2, "x", true), y = u.valToPos(layer.y[i], "y", true);
      ctx.fillRect(from, Math.min(y, foot), to - from, Math.abs(y - foot));
    }
  };

  // What is in view decides the range of y; limits count wherever they lie.
  const yRange = (panel, view) => (u, low, high) => {
    if (panel.y_range) return panel.y_range;
    const range = [low ?? Infinity, high ?? -Infinity], [min, max] = view.x;
    for (const layer of panel.layers) {
      if (layer.type === "horizontal") widen(range, layer.y);
      if (layer.type === "bars") widen(range, 0);
      if (layer.type === "points" || layer.type === "bars") {
        for (let i = 0; i < layer.x.length; i++) {
          if (layer.x[i] >= min && layer.x[i] <= max) widen(range, layer.y[i]);
        }
      }
    }
    if (range[0] > range[1]) return [0, 1];
    if (panel.y_log) return [range[0] > 0 ? range[0] / 1.5 : 1e-3, Math.max(range[1], 1e-3) * 1.5];
    const room = range[1] > range[0] ? 0.06 * (range[1] - range[0]) : 0.1 * Math.abs(range[0]) || 1;
    return [range[0] - room, range[1] + room];
  };

  // Shows a stretch of x in every plot of the group, kept within the whole.
  const show = (group, low, high) => {
    const [first, last] = group.whole, span = Math.min(Math.max(high - low, 1e-9 * (last - first)), last - first);
    low = Math.min(Math.max(low, first), last - span);
    high = low + span;
    if (group.now[0] === low && group.now[1] === high) return;
    group.now = [low, high];
    for (const u of group.plots) {
      if (u.scales.x.min !== low || u.scales.x.max !== high) u.setScale("x", { min: low, max: high });
    }
  };
  const reset = (group) => { group.now = []; show(group, ...group.whole); };
  const zoom = (group, factor, at) => {
    const [low, high] = group.now, centre = at ?? (low + high) / 2;
    show(group, centre - (centre - low) * factor, centre + (high - centre) * factor);
  };
  const pan = (group, part) => {
    const [low, high] = group.now, by = part * (high - low);
    show(group, low + by, high + by);
  };

  // Shift and the pointer move the view; the pointer alone selects what to zoom into.
  const panWithPointer = (u, group, begun) => {
    const [low, high] = group.now, from = begun.clientX, scale = (high - low) / u.over.clientWidth;
    const move = (event) => show(group, low - (event.clientX - from) * scale, high - (event.clientX - from) * scale);
    const end = () => { removeEventListener("mousemove", move); removeEventListener("mouseup", end); };
    addEventListener("mousemove", move);
    addEventListener("mouseup", end);
  };

  const swatch = (layer) => {
    const ink = `var(--${layer.colour})`;
    const line = (dash) => `<line x1="0" y1="6" x2="22" y2="6" stroke="${ink}" stroke-width="${layer.colour === "grey" ? 3 : 2}" stroke-dasharray="${dash}"/>`;
    const area = (opacity) => `<rect y="1" width="22" height="10" fill="${ink}" fill-opacity="${opacity}" stroke="${ink}"/>`;
    const shapes = {
      line: () => line(layer.dashed ? "6 3" : ""),
      horizontal: () => line(layer.dashed ? "3 3" : ""),
      vertical: () => line(layer.dashed ? "3 3" : ""),
      band: () => area(0.3), span: () => area(0.25), bars: () => area(0.85),
      points: () => layer.marker === "cross"
        ? `<path d="M7 2l8 8M7 10l8-8" stroke="${ink}" stroke-width="2"/>` : `<circle cx="11" cy="6" r="3" fill="${ink}"/>`,
    };
    return `<svg width="22" height="12" aria-hidden="true">${shapes[layer.type]()}</svg>`;
  };

  // Names and, under the cursor, values. Returns what to call when the cursor moves. What a panel above has named is a sample and its
  // value here.
  const makeLegend = (parent, panel, lines, known) => {
    const legend = element("div", parent, { className: "legend" });
    if (panel.title) element("b", legend, { textContent: panel.title });
    const seen = new Set(), values = [];
    for (const layer of panel.layers) {
      const look = [layer.type, layer.name, layer.colour, layer.dashed].join();
      if (!layer.name || seen.has(look)) continue;
      seen.add(look);
      const entry = element("span", legend, { innerHTML: swatch(layer), title: layer.name });
      // What is named over another panel shows again only beside its value.
      if (known.has(look)) entry.className = "again"; else entry.append(layer.name);
      known.add(look);
      const line = lines.find((l) => l.layer === layer);
      if (line) values.push({ index: line.index, place: element("span", entry, { className: "value" }) });
    }
    return (u) => {
      for (const { index, place } of values) {
        let at = u.cursor.idx;
        // Where lines have times of their own, the one before counts.
        while (at > 0 && u.data[index][at] === undefined) at--;
        place.textContent = at == null ? "" : shown(u.data[index][at]);
      }
    };
  };

  const axisOf = (label, names, size, visible, dates) => ({
    stroke: () => colour("text"), font: "12px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif",
    grid: { stroke: () => colour("grid"), width: 1 }, ticks: { stroke: () => colour("rule"), width: 1, size: 4 },
    label: visible && label ? label : undefined, labelSize: 22, labelGap: 0, size, gap: 4,
    ...(names.length ? { splits: () => names.map(([at]) => at) } : {}),
    ...(dates && visible ? {} : { values: (u, splits) => !visible ? splits.map(() => "")
      : names.length ? splits.map((at) => names.find(([x]) => x === at)?.[1] ?? "") : ticks(splits) }),
  });

  const makePlot = (panel, grids, parent, group, { height, showX, linked, known, tell }) => {
    const place = element("div", parent, { className: "panel" });
    const { data, lines, bands, count } = table(panel, grids);
    // A name that is longer than its axis stands over the panel.
    const isLong = panel.y_label.length * 7 > height - 30;
    const head = [panel.title, isLong ? panel.y_label : ""].filter((text) => text).join(", ");
    const legend = makeLegend(place, { ...panel, title: head }, lines, known);
    const canvas = element("div", place);
    const series = [{}, ...Array.from({ length: count }, () => ({ stroke: "transparent", width: 0, points: { show: false } }))];
    for (const { layer, index } of lines) {
      series[index] = { label: layer.name, stroke: () => colour(layer.colour), width: layer.colour === "grey" ? 3 : 1.5,
        dash: layer.dashed ? DASH : undefined, points: { show: false } };
    }
    const x = panel.x_label.split(" / "), view = { x: group.whole };
    const told = (at) => panel.x_dates ? new Date(at * 1e3).toISOString().replace("T", " ").slice(0, 19) : `${x[0]} = ${shown(at)} ${x[1] ?? ""}`;
    const u = new uPlot({
      width: width(place), height,
      padding: [6, 14, 0, 0],
      tzDate: (seconds) => uPlot.tzDate(new Date(seconds * 1e3), "UTC"),
      legend: { show: false },
      scales: {
        // uPlot ranges x before y, and tells y nothing of x.
        x: { time: panel.x_dates, distr: panel.x_log ? 3 : 1, range: (u, low, high) => (view.x = [low, high]) },
        y: { distr: panel.y_log ? 3 : 1, range: yRange(panel, view) },
      },
      series,
      bands: bands.map((b) => ({ series: [b.upper, b.lower], fill: () => shade(b.layer.colour, 30) })),
      axes: [axisOf(panel.x_label, panel.x_names, showX ? (panel.x_dates ? 44 : 28) : 8, showX, panel.x_dates), axisOf(isLong ? "" : panel.y_label, panel.y_names, panel.y_label && !isLong ? LEFT - 22 : LEFT, true)],
      cursor: {
        sync: linked ? { key: group.name, filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } } : undefined,
        drag: { x: true, y: !linked, uni: 20 }, points: { size: 6 },
        bind: {
          dblclick: () => () => { reset(group); return null; },
          mousedown: (u, target, handler) => (event) => {
            if (event.shiftKey) panWithPointer(u, group, event); else handler(event);
            return null;
          },
        },
      },
      hooks: {
        drawClear: [(u) => drawBehind(u, panel)],
        draw: [(u) => drawFront(u, panel)],
        setScale: [(u, key) => { if (key === "x" && group.plots.includes(u)) show(group, u.scales.x.min, u.scales.x.max); }],
        setCursor: [(u) => { legend(u); if (u.cursor.left >= 0) tell(told(u.posToVal(u.cursor.left, "x"))); }],
      },
    }, data, canvas);
    u.setScale("x", { min: group.whole[0], max: group.whole[1] });
    u.over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      zoom(group, event.deltaY > 0 ? 1.25 : 0.8, u.posToVal(event.offsetX, "x"));
    }, { passive: false });
    const names = panel.layers.map((l) => l.name).filter(Boolean).join(", ");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${panel.y_label} over ${panel.x_label || "x"}: ${names}`);
    group.plots.push(u);
    plots.push({ u, place, height });
  };

  const width = (place) => Math.max(200, place.clientWidth);

  const makeTools = (figure, targets) => {
    const tools = element("div", figure, { className: "tools" });
    figure.prepend(tools);
    const all = (act) => targets().forEach(act);
    const actions = [
      ["\u2212", "Zoom out", () => all((g) => zoom(g, 1.6))], ["+", "Zoom in", () => all((g) => zoom(g, 1 / 1.6))],
      ["\u25c0", "Earlier", () => all((g) => pan(g, -0.25))], ["\u25b6", "Later", () => all((g) => pan(g, 0.25))],
      ["Reset", "Show all", () => all(reset)],
    ];
    for (const [text, label, act] of actions) {
      element("button", tools, { type: "button", textContent: text, title: label, ariaLabel: label, onclick: act });
    }
    element("span", tools, { className: "hint", textContent: "drag: zoom, shift and drag: move; keys: + \u2212 \u2190 \u2192 0" });
    const keys = { "+": 1, "=": 1, "-": 0, ArrowLeft: 2, ArrowRight: 3, 0: 4, Home: 4 };
    figure.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || keys[event.key] === undefined) return;
      event.preventDefault();
      actions[keys[event.key]][2]();
    });
    return element("output", tools);
  };

  const makeFigure = (data, figure) => {
    const grids = data.grids.map(xOf), parent = figure.querySelector(".panels"), own = new Set();
    parent.style.gridTemplateColumns = `repeat(${data.columns}, minmax(0, 1fr))`;
    figure.tabIndex = 0;
    figure.setAttribute("role", "group");
    figure.setAttribute("aria-label", figure.querySelector("figcaption").textContent);
    const output = makeTools(figure, () => own);
    const linked = data.shared_x, known = new Set();
    data.panels.forEach((panel, i) => {
      const name = !linked ? `${figure.id}-${i}` : data.axis ?? figure.id;
      const whole = wholeRange(linked ? data.panels : [panel], grids);
      if (!groups.has(name)) groups.set(name, { name, whole, now: whole, plots: [] });
      const group = groups.get(name);
      own.add(group);
      const last = !linked || i + data.columns >= data.panels.length;
      const label = linked ? data.panels.findLast((p) => p.x_label)?.x_label ?? "" : panel.x_label;
      makePlot({ ...panel, x_label: label }, grids, parent, group, {
        height: Math.max(data.height - 30, 110) + (last ? 36 : 0), showX: last, linked, known, tell: (text) => { output.value = text; },
      });
    });
  };

  // Figures with one axis show its whole together: the widest of them.
  const wholeOfAxes = () => {
    figures.forEach((data, i) => {
      if (!data.shared_x) return;
      const name = data.axis ?? `f${i}`, [low, high] = wholeRange(data.panels, data.grids.map((g) =>
        Array.isArray(g) ? g : [g.start, g.start + (g.count - 1) * g.step]));
      const group = groups.get(name) ?? { name, whole: [low, high], plots: [] };
      group.whole = [Math.min(group.whole[0], low), Math.max(group.whole[1], high)];
      group.now = group.whole;
      groups.set(name, group);
    });
  };

  const resize = () => plots.forEach(({ u, place, height }) => {
    if (place.clientWidth > 0 && u.width !== width(place)) u.setSize({ width: width(place), height });
  });
  const redraw = () => plots.forEach(({ u }) => u.redraw(false, true));

  wholeOfAxes();
  figures.forEach((data, i) => makeFigure(data, document.getElementById(`f${i}`)));
  new ResizeObserver(resize).observe(document.body);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  for (const details of document.querySelectorAll("details")) details.addEventListener("toggle", resize);
  // Paper is white and shows the still pictures, which fit any width; what is folded is printed as well.
  const forPaper = (on) => () => {
    document.documentElement.classList.toggle("paper", on);
    if (on) document.querySelectorAll("details:not([open])").forEach((d) => { d.open = d.dataset.folded = true; });
    else document.querySelectorAll("details[data-folded]").forEach((d) => { d.open = false; delete d.dataset.folded; });
  };
  addEventListener("beforeprint", forPaper(true));
  addEventListener("afterprint", forPaper(false));
  // For tests, and for whoever wants to look closer.
  globalThis.driftReport = { groups, plots };
})();
