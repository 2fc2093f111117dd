"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const make = (tag, text, kind) => {
    const node = document.createElement(tag);
    if (text !== undefined) node.textContent = text;
    if (kind) node.className = kind;
    return node;
  };
  const figure = (x) => x === null || x === undefined || Number.isNaN(x) ? "no number"
    : x === 0 ? "0" : Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3
      ? x.toExponential(3).replace(/\.?0*e\+?/, "e") : String(+x.toPrecision(5));
  const rows = (pairs) => {
    const table = make("table");
    for (const [name, value] of pairs) {
      const row = table.insertRow();
      row.append(make("th", name));
      row.append(make("td", value));
    }
    return table;
  };
  const summary = data.summary;

  // What happened.
  $("title").textContent = data.title;
  const outcome = $("outcome");
  if (summary) {
    outcome.append(make("span", summary.status, `status ${summary.status}`));
    outcome.append(`: ${summary.steps_completed} of ${summary.steps_requested} steps, ${figure(summary.wall_seconds.total)} s on ${summary.ranks} rank${summary.ranks === 1 ? "" : "s"}`);
    if (summary.reason) outcome.append(make("div", summary.reason));
    const warnings = summary.warnings || [];
    $("warnings-part").hidden = !warnings.length;
    warnings.forEach((text) => $("warnings").append(make("li", text)));
    const lattice = data.grid;
    const facts = [["points", summary.points],
      ...(lattice ? [["grid", `${lattice.size.map(figure).join(" by ")} m from (${lattice.origin.map(figure).join(", ")}), h = ${[...new Set(lattice.h.map(figure))].join(", ")} m`]] : []),
      ["populated cells", summary.cells_populated],
      ["ranks", `${summary.ranks}, imbalance ${figure(summary.imbalance)}`]];
    if (summary.newton_iterations.total)
      facts.push(["Newton iterations", `${summary.newton_iterations.total}, at most ${summary.newton_iterations.max} in a step`]);
    if (summary.linear_iterations.total)
      facts.push(["linear iterations", `${summary.linear_iterations.total}, at most ${summary.linear_iterations.max} in a step`]);
    // In plane strain the run counts per metre of thickness, as its table says.
    const plane = (data.tables.history?.header || []).some((name) => name.endsWith("[J/m]"));
    const [mass, volume] = plane ? ["kg/m", "m2"] : ["kg", "m3"];
    for (const [name, body] of Object.entries(summary.bodies || {})) {
      // Round-off beside the body's size is nothing.
      const size = Math.max(...body.extent_max.map((x, k) => x - body.extent_min[k]));
      const place = (x) => figure(Math.abs(x) < 1e-6 * size ? 0 : x);
      facts.push([`body ${name}`, `from (${body.extent_min.map(place).join(", ")}) to (${body.extent_max.map(place).join(", ")}) m, mass ${figure(body.mass)} ${mass}, volume ${figure(body.volume)} ${volume}`]);
    }
    for (const [name, value] of Object.entries(summary.verify || {})) facts.push([`verify ${name}`, figure(value)]);
    facts.push(["versions", Object.entries(summary.versions).map(([n, v]) => `${n} ${v}`).join(", ")]);
    $("facts").append(rows(facts));
  } else {
    outcome.append(make("span", "not finished", "status stopped"));
    outcome.append(": there is no summary.json; the run goes on, or was killed.");
  }

  // Curves.
  const ink = () => getComputedStyle(document.body).color;
  const COLOURS = ["#1e6fb8", "#d1541f", "#2a9454", "#9a4fb5", "#b8860b", "#c2306b", "#3b8f9e", "#6b6b6b", "#7a4a21"];
  const short = (name) => name.replace(/ \[-\]$/, "");
  const curve = (host, caption, x, ys, options = {}) => {
    const box = make("figure");
    box.append(make("figcaption", caption));
    host.append(box);
    const width = Math.max(Math.min(box.clientWidth || 480, 1060), 280);
    const axis = { stroke: ink, grid: { stroke: "#8885", width: 1 }, ticks: { stroke: "#8885", width: 1 } };
    const values = (_, ticks) => ticks.map((t) => (t === null ? "" : figure(t)));
    // Of a logarithmic axis the powers of ten, of many every few.
    const powers = (_, ticks) => {
      const whole = (t) => Math.abs(Math.log10(t) - Math.round(Math.log10(t))) < 1e-9;
      const every = Math.ceil(ticks.filter(whole).length / 8);
      return ticks.map((t) => (whole(t) && Math.round(Math.log10(t)) % every === 0 ? figure(t) : null));
    };
    const shown = (_, v) => (v === null || v === undefined ? "" : figure(v));
    const sorted = x.values.every((v, i) => i === 0 || x.values[i - 1] <= v);
    // A path that turns back is drawn as points and lines in its own order.
    const opts = {
      width, height: options.height || 260,
      scales: { x: { time: false, auto: true }, y: options.log ? { distr: 3 } : {} },
      axes: [{ ...axis, label: short(x.name), labelSize: 20, values }, { ...axis, size: 74, values: options.log ? powers : values, ...(options.log ? { grid: { show: false }, ticks: { show: false } } : {}) }],
      series: [{ label: short(x.name), value: shown },
        ...ys.map((y, k) => ({ label: short(y.name), stroke: COLOURS[k % COLOURS.length], width: 1.6,
          points: { show: y.values.length < 60, size: 4 }, value: shown }))],
    };
    let table = [x.values, ...ys.map((y) => (options.log ? y.values.map((v) => (v > 0 ? v : null)) : y.values))];
    if (!sorted) {
      opts.mode = 2;
      opts.series = [null, ...opts.series.slice(1).map((s) => ({ ...s, paths: path, points: { show: false } }))];
      opts.scales.x.range = (_, a, b) => padded(x.values, a, b);
      opts.scales.y.range = (_, a, b) => padded(ys.flatMap((y) => y.values), a, b);
      opts.legend = { show: true, live: false };
      opts.cursor = { show: false };
      table = [null, ...table.slice(1).map((y) => [table[0], y])];
    }
    new uPlot(opts, table, box);
    return box;
  };
  const padded = (values) => {
    const good = values.filter((v) => v !== null);
    const [a, b] = [Math.min(...good), Math.max(...good)], room = (b - a || Math.abs(a) || 1) * 0.04;
    return [a - room, b + room];
  };
  const path = (u, s) => {
    uPlot.orient(u, s, (series, xs, ys, sx, sy, vx, vy, left, top, w, h) => {
      const line = new Path2D();
      let pen = false;
      xs.forEach((x, i) => {
        if (x === null || ys[i] === null) { pen = false; return; }
        const [px, py] = [vx(x, sx, w, left), vy(ys[i], sy, h, top)];
        if (pen) line.lineTo(px, py); else line.moveTo(px, py);
        pen = true;
      });
      u.ctx.save(); u.ctx.strokeStyle = series.stroke(); u.ctx.lineWidth = 1.6 * devicePixelRatio; u.ctx.stroke(line); u.ctx.restore();
    });
    return null;
  };
  const tables = data.tables;
  const column = (table, name) => {
    const k = table.header.findIndex((title) => title === name || title.split(" [")[0] === name);
    return k < 0 ? null : { name: table.header[k], values: table.columns[k] };
  };
  const changes = (c) => c && c.values.some((v) => v !== null && v !== 0);
  // The load factor begins anew in each stage.
  const grows = (c) => changes(c) && c.values.every((v, k) => k === 0 || v >= c.values[k - 1]);
  const across = (table) =>
    ["time", "load_factor"].map((name) => column(table, name)).find(grows) || column(table, "step");
  const host = $("curves");
  const group = (caption, table, wanted, options) => {
    const ys = table.header.map((title, k) => ({ name: title, values: table.columns[k] }))
      .filter((c) => wanted(c.name.split(" [")[0]) && changes(c));
    if (ys.length && table.columns[0].length > 1) curve(host, caption, across(table), ys.slice(0, 12), options);
  };
  const { history, residuals, probes, element } = tables;
  if (residuals && residuals.columns[0].length > 1) {
    const count = { name: "evaluation", values: residuals.columns[0].map((_, k) => k + 1) };
    curve(host, "Convergence: residual of each evaluation", count, [column(residuals, "residual")], { log: true });
  }
  if (history) {
    group("Iterations of each step", history, (n) => ["newton_iterations", "linear_iterations", "cuts"].includes(n));
    group("Energies", history, (n) => n.startsWith("energy_") || n.startsWith("work_") || n.startsWith("dissipation_"));
    group("Reactions", history, (n) => /^reaction\..*\.[xyz]$/.test(n));
    for (const quantity of ["area", "slip", "gap_max"])
      group(`Contact: ${quantity}`, history, (n) => n.startsWith("contact.") && n.endsWith(`.${quantity}`));
    group("Rigid bodies", history, (n) => /^rigid\./.test(n));
    group("Momentum", history, (n) => n.startsWith("momentum_"));
    group("Condition numbers", history, (n) => n.startsWith("kappa_"), { log: true });
    group("Time step", history, (n) => n === "dt");
    group("Balance: load of the busiest rank over the mean", history, (n) => n === "imbalance");
  }
  if (probes) {
    // Columns of one unit share a picture.
    const units = new Map();
    probes.header.slice(3).forEach((title) => {
      const unit = title.slice(title.lastIndexOf("[") + 1, -1);
      const quantity = title.split(" [")[0].split(".").slice(1)[0];
      const key = `${quantity} ${unit}`;
      units.set(key, [...(units.get(key) || []), title]);
    });
    for (const [key, titles] of units)
      group(`Probes: ${key.split(" ")[0]}`, probes, (name) => titles.some((title) => title.split(" [")[0] === name));
  }
  if (element) {
    const get = (name) => column(element, name);
    const strain = get("strain_1");
    curve(host, "Deviator against axial strain", strain, [get("q"), get("p")].filter(Boolean));
    curve(host, "Stress path", get("p"), [get("q")]);
    curve(host, "Volume against axial strain", strain, [get("J")]);
  }
  if (!host.children.length) host.append(make("p", "No table has two rows yet.", "note"));
  for (const [name, table] of Object.entries(tables))
    if (table.every > 1) host.append(make("p", `Of ${name}.csv, which has ${table.rows} rows, one in ${table.every} is drawn.`, "note"));
  const [anyTable, anyX, anyY, anyLog] = ["any-table", "any-x", "any-y", "any-log"].map($);
  Object.keys(tables).forEach((name) => anyTable.append(make("option", name)));
  const anyDraw = () => {
    $("any").replaceChildren();
    const table = tables[anyTable.value];
    if (table && table.columns[0].length > 1)
      curve($("any"), `${short(anyY.value)} against ${short(anyX.value)}`, column(table, anyX.value), [column(table, anyY.value)], { log: anyLog.checked, height: 320 });
  };
  const anyColumns = () => {
    const table = tables[anyTable.value];
    if (!table) return;
    const x = across(table).name;
    const y = table.header.find((title) => !/^(step|load_factor|time|dt) /.test(title) && changes(column(table, title)));
    for (const [select, first] of [[anyX, x], [anyY, y || x]]) {
      select.replaceChildren(...table.header.map((title) => make("option", title)));
      select.value = first;
    }
    anyDraw();
  };
  anyTable.addEventListener("change", anyColumns);
  [anyX, anyY, anyLog].forEach((control) => control.addEventListener("change", anyDraw));
  anyColumns();

  // Time and memory.
  if (summary) {
    const phases = Object.entries(summary.wall_seconds).filter(([name]) => name !== "total").sort((a, b) => b[1] - a[1]);
    const total = summary.wall_seconds.total || 1;
    phases.push(["other", Math.max(total - phases.reduce((sum, [, t]) => sum + t, 0), 0)]);
    const table = make("table");
    for (const [name, seconds] of phases) {
      const row = table.insertRow();
      row.append(make("th", name), make("td", `${seconds.toFixed(3)} s`, "number"), make("td", `${(100 * seconds / total).toFixed(1)} %`, "number"));
      const bar = make("span", "", "share");
      bar.style.width = `${(14 * seconds / total).toFixed(2)}rem`;
      row.insertCell().append(bar);
    }
    $("time").append(table);
    const memory = summary.peak_memory_bytes;
    $("time").append(make("p", `Peak memory ${(memory.sum / 1e6).toFixed(1)} MB in all, ${(memory.max / 1e6).toFixed(1)} MB on one rank.`));
    const balance = summary.balance;
    if (balance && balance.rebalanced) $("time").append(make("p", `Rebalanced ${balance.rebalanced} times; largest imbalance ${figure(balance.largest_imbalance)}.`));
  } else {
    $("time").append(make("p", "Known at the end of the run.", "note"));
  }
  $("deck").textContent = data.deck;
  $("log").textContent = data.log;

  // Points.
  const points = data.points;
  if (!points) {
    $("points-part").hidden = true;
    return;
  }
  const [canvas, field, frame, play] = ["canvas", "field", "frame", "play"].map($);
  points.columns.forEach((c) => field.append(make("option", c.name)));
  frame.max = points.frames.length - 1;
  const start = new URLSearchParams(location.hash.replace(/^#/, ""));
  const view = new Points.View(canvas, points, data.grid);
  view.frame = Math.min(Math.max(+(start.get("frame") ?? points.frames.length - 1) || 0, 0), points.frames.length - 1);
  view.field = Math.max(points.columns.findIndex((c) => c.name === (start.get("field") || points.columns[0].name)), 0);
  const bar = $("bar").getContext("2d");
  for (let k = 0; k < 256; k++) { bar.fillStyle = `rgb(${Points.colour(k / 255).join(",")})`; bar.fillRect(k, 0, 1, 12); }
  const show = () => {
    view.draw();
    field.value = points.columns[view.field].name;
    frame.value = view.frame;
    const { step, time } = points.frames[view.frame], history = tables.history;
    const isTime = history && changes(column(history, "time"));
    $("moment").textContent = `step ${step}, ${isTime ? `${figure(time)} s` : `load ${figure(time)}`}`;
    const [low, high] = view.range();
    $("low").textContent = figure(low); $("high").textContent = figure(high);
    $("unit").textContent = `${points.columns[view.field].name} ${points.columns[view.field].unit ? `[${points.columns[view.field].unit}]` : ""}`;
    canvas.setAttribute("aria-label", `Points at step ${step}, coloured by ${points.columns[view.field].name} from ${figure(low)} to ${figure(high)}`);
  };
  field.addEventListener("change", () => { view.field = field.selectedIndex; show(); });
  frame.addEventListener("input", () => { view.frame = +frame.value; show(); });
  $("own").addEventListener("change", (e) => { view.own = e.target.checked; show(); });
  $("lattice").addEventListener("change", (e) => { view.grid = e.target.checked; show(); });
  $("lattice").parentElement.hidden = !data.grid;
  $("reset").addEventListener("click", () => view.reset());
  let timer = 0;
  play.addEventListener("click", () => {
    if (timer) { clearInterval(timer); timer = 0; play.textContent = "Play"; return; }
    play.textContent = "Stop";
    timer = setInterval(() => { view.frame = (view.frame + 1) % points.frames.length; show(); }, 120);
  });
  $("hint").textContent = `${view.flat ? "Drag or arrow keys move the picture" : "Drag or arrow keys turn the body, with Shift they move it"}, the wheel or + and - zoom, , and . go through the frames, 0 resets.`
    + (points.stride > 1 ? ` Of ${points.all} points one in ${points.stride} is shown: the files hold all.` : ` All ${points.all} points are shown.`)
    + (points.frames.length < points.written ? ` Of ${points.written} frames ${points.frames.length} are shown.` : "");
  canvas.addEventListener("keydown", (e) => {
    const arrows = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] };
    if (arrows[e.key]) view.move(...arrows[e.key], !e.shiftKey);
    else if (e.key === "+" || e.key === "=") view.scaleBy(1.2);
    else if (e.key === "-") view.scaleBy(1 / 1.2);
    else if (e.key === "0") view.reset();
    else if (e.key === "," || e.key === ".") {
      view.frame = Math.min(Math.max(view.frame + (e.key === "." ? 1 : -1), 0), points.frames.length - 1);
      show();
    } else return;
    e.preventDefault();
  });
  let held = null;
  canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (held) {
      view.move(e.clientX - held[0], e.clientY - held[1], !e.shiftKey);
      held = [e.clientX, e.clientY];
      return;
    }
    const p = view.at(e.clientX, e.clientY);
    $("picked").textContent = p < 0 ? "" : `${points.columns[view.field].name} = ${figure(view.value(p))} ${points.columns[view.field].unit} at (${view.place(p).map(figure).join(", ")}) m`;
  });
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); view.scaleBy(e.deltaY < 0 ? 1.15 : 1 / 1.15); }, { passive: false });
  addEventListener("resize", () => view.draw());
  show();
})();
