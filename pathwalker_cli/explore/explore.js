// Dials, curves and numbers of an explored run; `gait` draws the walker, `answer` knows what a setting leads to.
(() => {
  const data = JSON.parse(document.getElementById("gait-data").textContent);
  const { dials } = data;
  const find = (selector) => document.querySelector(selector);
  const inputs = dials.map((_, i) => document.getElementById(`dial-${i}`));
  const outputs = dials.map((_, i) => document.getElementById(`value-${i}`));
  const explorer = find(".explorer");
  const run = { picture: data.picture, settings: Object.fromEntries(dials.map((d) => [d.key, d.value])) };

  let shown = run; // the last solved state, or what stands for it
  const before = [run]; // states before it, the last one is the shadow
  let settings = { ...run.settings };
  let latest = 0; // number of the last move
  let saving = false;
  let undoing = false;
  let solving = false;

  const CHAINS = [false, true].flatMap((left) => {
    const s = left ? "l" : "r";
    return [["hip", "knee", "ankle"], ["ankle", "heel", "toe", "ankle"]].map((names) => (
      { left, names: names.map((name) => `${name}_${s}`) }));
  }).concat({ left: false, names: ["lumbar", "neck", "head"] }, { left: false, names: ["hip_r", "lumbar"] });

  function say(kind, text, look) {
    find("#kind").textContent = kind;
    find("#kind").className = `kind ${look || ""}`;
    find("#status").textContent = text;
    explorer.classList.toggle("guess", look === "guess");
  }

  // Three digits that mean something: 92.0, 5.00, -1.15.
  const digits = (value, high) => value.toFixed(high >= 100 ? 0 : high >= 20 ? 1 : 2);

  function showDials() {
    dials.forEach((dial, i) => {
      const value = settings[dial.key];
      const at = value === null ? shown.picture.found[dial.key] : value;
      if (document.activeElement !== inputs[i] || value === null) inputs[i].value = at * dial.size;
      inputs[i].disabled = saving || value === null;
      outputs[i].textContent = digits(at * dial.size, Math.max(Math.abs(dial.low), Math.abs(dial.high)) * dial.size);
      outputs[i].className = value === dial.value ? "" : "moved";
    });
    if (find("#save")) find("#save").disabled = saving || solving;
    document.querySelectorAll("[data-free]").forEach((tick) => {
      tick.checked = places(tick, "free").every((i) => settings[dials[i].key] === null);
    });
  }

  const places = (tick, kind) => tick.dataset[kind].split(" ").map(Number);

  function show(picture, last) {
    const now = gait.panels[0];
    now.run = picture.walker;
    const { points, middle, distance } = last.picture.walker;
    now.run.shadow = last === shown && picture === shown.picture ? null : { points, middle, distance, chains: CHAINS };
    gait.draw();
    showCurves(picture, last.picture);
    showNumbers(picture, last.picture);
  }

  const NS = "http://www.w3.org/2000/svg";
  const COLOURS = data.lines;
  const [WIDTH, HEIGHT, LEFT, BOTTOM] = [220, 130, 30, 16];
  const figures = data.curves.map((curve) => {
    const figure = find(".curves").appendChild(document.createElement("figure"));
    figure.innerHTML = `<figcaption></figcaption><svg viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img"></svg>`;
    figure.querySelector("figcaption").textContent = `${curve.title[0].toUpperCase()}${curve.title.slice(1)}, ${curve.label}`;
    figure.querySelector("svg").setAttribute("aria-label", `${curve.title} over the gait cycle of each side`);
    // room for what other settings may bring
    const values = data.picture.curves[curve.key].flat();
    const [low, high] = [Math.min(...values, curve.zero ? 0 : Infinity), Math.max(...values, curve.zero ? 0 : -Infinity)];
    return { svg: figure.querySelector("svg"), curve, low, high };
  });

  function add(svg, name, attributes, text) {
    const made = svg.appendChild(document.createElementNS(NS, name));
    Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
    if (text !== undefined) made.textContent = text;
  }

  function showCurves(picture, last) {
    figures.forEach((figure) => {
      const { svg, curve } = figure;
      const all = [picture, last].flatMap((each) => each.curves[curve.key].flat());
      figure.low = Math.min(figure.low, ...all);
      figure.high = Math.max(figure.high, ...all);
      const room = 0.05 * (figure.high - figure.low || 1);
      const [low, high] = [figure.low - room, figure.high + room];
      const x = (percent) => LEFT + (percent / 100) * (WIDTH - LEFT - 4);
      const y = (value) => 4 + ((high - value) / (high - low)) * (HEIGHT - BOTTOM - 8);
      svg.replaceChildren();
      const step = niceStep(high - low);
      for (let v = Math.ceil(low / step) * step; v <= high; v += step) {
        const value = Math.abs(v) < step / 1000 ? 0 : v;
        add(svg, "path", { d: `M${LEFT} ${y(value)}H${WIDTH - 4}`, stroke: value === 0 && curve.zero ? "#777" : "#ddd", "stroke-width": 0.6 });
        add(svg, "text", { x: LEFT - 3, y: y(value) + 3, "text-anchor": "end" }, Number(value.toFixed(2)));
      }
      for (const percent of [0, 50, 100]) {
        add(svg, "text", { x: x(percent) - (percent === 100 ? 10 : 0), y: HEIGHT - 4, "text-anchor": "middle" }, percent === 100 ? "100 %" : percent);
      }
      [[last, 0.4, "before"], [picture, 1, "now"]].forEach(([each, opacity, name]) => {
        each.curves[curve.key].forEach((values, side) => {
          const colour = COLOURS[side];
          const d = "M" + values.map((v, i) => `${x((100 * i) / (values.length - 1)).toFixed(1)} ${y(v).toFixed(2)}`).join("L");
          add(svg, "path", { d, fill: "none", stroke: colour, opacity, class: name, "stroke-width": name === "now" ? 1.6 : 2.2, ...(side ? { "stroke-dasharray": "5 3" } : {}) });
          add(svg, "path", { d: `M${x(each.toe_off[side])} ${HEIGHT - BOTTOM}v4`, stroke: colour, opacity, "stroke-width": 1.4 });
        });
      });
    });
  }

  function niceStep(range) {
    const rough = range / 4;
    const power = 10 ** Math.floor(Math.log10(rough));
    return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  }

  const rows = data.numbers.filter(({ key }) => key in data.picture.values).map((number) => {
    const row = find(".numbers tbody").insertRow();
    row.innerHTML = '<th scope="row"></th><td></td><td></td><td></td>';
    row.cells[0].textContent = number.unit ? `${number.label} [${number.unit}]` : number.label;
    return { number, cells: [...row.cells].slice(1) };
  });

  function showNumbers(picture, last) {
    rows.forEach(({ number, cells }) => {
      const texts = [picture, last, run.picture].map(({ values }) =>
        (number.key in values ? values[number.key].toFixed(number.digits) : "-"));
      cells.forEach((cell, k) => { cell.textContent = texts[k]; });
      cells[0].className = texts[0] === texts[1] ? "" : "changed";
    });
  }

  // What comes back from a move.
  function hear(message) {
    const old = message.number < latest; // of a position that was left
    if (message.kind === "first order" && !old) {
      show(message.picture, shown);
      say("first order", "the change from the state before, not solved yet", "guess");
    } else if (message.kind === "solved" || message.kind === "better") {
      const state = { picture: message.picture, settings: message.settings };
      if (message.kind === "solved" && !undoing) before.push(shown);
      undoing = false;
      shown = state;
      if (old) return;
      solving = false;
      show(shown.picture, before[before.length - 1]);
      showDials();
      say(message.label || "solved", message.kind === "better"
        ? "a better walk for this setting, found from the run" : message.note || `in ${message.seconds.toFixed(2)} s`, message.look);
    } else if (message.kind === "moved") {
      latest = message.number;
      settings = message.settings;
      solving = true;
      showDials();
    } else if (message.kind === "refused") {
      if (old) return;
      saving = solving = undoing = false;
      settings = { ...shown.settings };
      show(shown.picture, before[before.length - 1]);
      showDials();
      say("not possible", message.sentence, "bad");
    } else if (message.kind === "saved") {
      saving = false;
      showDials();
      const differs = Math.abs(message.cost - message.shown) > 0.01 * Math.abs(message.shown);
      say("saved", `in ${message.folder}, cost ${message.cost.toPrecision(4)}${differs ? `: on the finer mesh it is another walk than the one shown, ${message.shown.toPrecision(4)}` : ""}`);
    } else if (message.kind === "ended") {
      saving = true;
      showDials();
      say("ended", message.sentence, "bad");
    }
  }

  function move(next) {
    settings = next;
    showDials();
    answer.move(settings);
  }

  inputs.forEach((input, i) => input.addEventListener("input", () => {
    const next = { ...settings };
    next[dials[i].key] = Number(input.value) / dials[i].size;
    const tick = [...document.querySelectorAll("[data-tied]")].find((each) => each.checked && places(each, "tied").includes(i));
    for (const other of tick ? places(tick, "tied").filter((k) => k !== i) : []) {
      const [here, there] = [dials[i], dials[other]];
      const wanted = {
        value: () => next[here.key],
        factor: () => (there.value * next[here.key]) / here.value,
        shift: () => there.value + next[here.key] - here.value,
      }[here.tied]();
      next[there.key] = Math.min(Math.max(wanted, there.low), there.high);
    }
    move(next);
  }));
  document.querySelectorAll("[data-free]").forEach((tick) => tick.addEventListener("change", () => {
    const next = { ...settings };
    places(tick, "free").forEach((i) => { next[dials[i].key] = tick.checked ? null : shown.picture.found[dials[i].key]; });
    move(next);
  }));
  find("#home").addEventListener("click", () => move({ ...run.settings }));
  find("#undo").addEventListener("click", () => {
    if (before.length < 2) return;
    undoing = true;
    move({ ...before.pop().settings });
  });
  find("#save")?.addEventListener("click", () => {
    if (!find("#name").reportValidity() || !find("#name").value) return;
    saving = true;
    showDials();
    say("saving", "solving on a mesh of the accuracy of the run's config", "guess");
    answer.save(find("#name").value);
  });

  answer.hear(hear);
  show(run.picture, run);
  showDials();
  say("the run", "");
})();
