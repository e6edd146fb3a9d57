// Correlations as a map: names under the pointer or the arrows, and by a click or Enter the draws of the pair.
widget("correlation", (box) => {
  const { names, labels, hundredths, reference, prior, draws, strong } = content.pairs;
  const rho = (i, j) => (i === j ? 1 : hundredths[i > j ? (i * (i - 1)) / 2 + j : (j * (j - 1)) / 2 + i] / 100);
  const unpacked = new Map();
  const of = (i) => unpacked.get(i) ?? unpacked.set(i, unpack(draws[i])).get(i);
  const words = (i, j) => `${names[i]} with ${names[j]}: correlation ${signed(rho(i, j))}`;
  let shown = strong;
  let cell = [1, 0];
  let pair = null;
  const all = make("input", { type: "checkbox" });

  const canvas = make("canvas", { tabindex: "0", role: "img" });
  const said = make("output", { class: "words" });
  const scale = make("p", { class: "scale", "aria-hidden": "true" }, "\u22121 ", make("i"), " +1 correlation");
  const map = make("div", { class: "map" }, canvas, scale, said);
  const scatter = make("div", { class: "pair" });

  function paint() {
    const size = Math.min(map.clientWidth, 540);
    const n = shown.length;
    const named = n <= 42;
    const font = Math.min(12, (0.8 * size) / n);
    const context = canvas.getContext("2d");
    context.font = `${font}px system-ui`;
    const margin = named ? Math.ceil(Math.max(...shown.map((i) => context.measureText(names[i]).width))) + 6 : 2;
    canvas.width = canvas.height = size * devicePixelRatio;
    canvas.style.width = canvas.style.height = `${size}px`;
    context.scale(devicePixelRatio, devicePixelRatio);
    context.font = `${font}px system-ui`;
    canvas.grid = { margin, step: (size - margin) / n };
    const { step } = canvas.grid;
    context.textBaseline = "middle";
    shown.forEach((i, row) => {
      shown.forEach((j, column) => {
        context.globalAlpha = i === j ? 0.25 : Math.abs(rho(i, j));
        context.fillStyle = colour(i === j ? "ink" : rho(i, j) < 0 ? "negative" : "positive");
        context.fillRect(margin + column * step, margin + row * step, step - (step > 6), step - (step > 6));
      });
      context.globalAlpha = 1;
      context.fillStyle = colour("ink");
      context.textAlign = "center";
      if (step >= 22) {
        shown.forEach((j, column) => {
          if (i !== j && Math.abs(rho(i, j)) >= 0.5) context.fillText(rho(i, j).toFixed(1).replace("0.", ".").replace("-", "\u2212"), margin + (column + 0.5) * step, margin + (row + 0.5) * step);
        });
      }
      if (!named) return;
      context.fillStyle = colour("ink");
      context.textAlign = "right";
      context.fillText(names[i], margin - 4, margin + (row + 0.5) * step);
      context.save();
      context.translate(margin + (row + 0.5) * step, margin - 4);
      context.rotate(-Math.PI / 2);
      context.textAlign = "left";
      context.fillText(names[i], 0, 0);
      context.restore();
    });
    context.strokeStyle = colour("ink");
    context.lineWidth = 2;
    const [row, column] = cell;
    context.strokeRect(margin + column * step, margin + row * step, step, step);
  }

  function under(event) {
    const { left, top } = canvas.getBoundingClientRect();
    const { margin, step } = canvas.grid;
    const place = [event.clientY - top, event.clientX - left].map((value) => Math.floor((value - margin) / step));
    return place.every((value) => value >= 0 && value < shown.length) ? place : null;
  }

  function open(i, j) {
    pair = [i, j];
    const [x, y] = [of(j), of(i)];
    const range = (values, value) => {
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const near = value !== null && value > 2 * low - high && value < 2 * high - low ? value : low;
      const edges = [Math.min(low, near), Math.max(high, near)];
      return [edges[0] - 0.08 * (edges[1] - edges[0]), edges[1] + 0.08 * (edges[1] - edges[0])];
    };
    const { rows } = content.intervals;
    const sets = Math.max(i, j) < rows.length ? content.intervals.sets : [];
    const found = (values, k) => values[k].map((value) => (value === null ? null : value / (rows[k].reference || 1)));
    choices.forEach((choice, k) => { choice.value = pair[k]; });
    scatter.replaceChildren();
    const chart = new Chart(scatter, {
      name: words(i, j), labels: [labels[j], labels[i]], height: 440,
      layers: [
        { shape: "ellipse", colour: "muted", x: prior[j], y: prior[i], dashed: true },
        { shape: "dots", colour: "posterior", alpha: 0.55, x, y, size: 2 },
        ...sets.map(({ method, values }) => ({ shape: "dots", colour: method === "SQP" ? "sqp" : "linear", x: found(values, j), y: found(values, i), size: 3.5 })),
        { shape: "cross", colour: "ink", x: reference[j], y: reference[i], width: 0.8 },
      ],
      view: { x: range(x, reference[j]), y: range(y, reference[i]) },
      describe: (a, b) => `${labels[j]} ${Number(a.toPrecision(4))}, ${labels[i]} ${Number(b.toPrecision(4))}`,
    });
    const whole = make("button", { type: "button", title: "show 90 % of the prior" }, "prior");
    whole.addEventListener("click", () => chart.zoom({ x: range([...prior[j], ...x], null), y: range([...prior[i], ...y], null) }));
    scatter.querySelector(".controls").append(whole);
    scatter.append(legend([["posterior", `${x.length} draws of the posterior`], ["frame", "90 % of the prior, both at once"], ["reference", content.word],
      ...sets.map(({ method }) => [method === "SQP" ? "sqp" : "linear", method])]));
  }

  function select(place, opened) {
    const [i, j] = place.map((value) => shown[value]);
    if (opened && i === j) return;
    cell = place;
    said.textContent = opened || i === j ? "" : words(i, j);
    if (opened) open(i, j);
    paint();
  }

  canvas.addEventListener("pointermove", (event) => {
    const place = under(event);
    point(event, place && place[0] !== place[1] ? words(...place.map((value) => shown[value])) : "");
  });
  canvas.addEventListener("pointerleave", (event) => point(event, ""));
  canvas.addEventListener("click", (event) => { const place = under(event); if (place) select(place, true); });
  canvas.addEventListener("keydown", (event) => {
    const steps = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1], Enter: [0, 0], " ": [0, 0] };
    const step = steps[event.key];
    if (!step) return;
    event.preventDefault();
    select(cell.map((value, k) => Math.min(shown.length - 1, Math.max(0, value + step[k]))), !step[0] && !step[1]);
  });

  const choices = ["upwards", "to the right"].map((way, k) => {
    const choice = make("select", {}, names.map((name, i) => make("option", { value: i }, name)));
    choice.addEventListener("change", () => {
      const [i, j] = choices.map((one) => Number(one.value));
      if (i === j) { choices.forEach((one, n) => { one.value = pair[n]; }); return; }
      if (!shown.includes(i) || !shown.includes(j)) show(true);
      select([shown.indexOf(i), shown.indexOf(j)], true);
    });
    return choice;
  });
  const controls = make("div", { class: "choices" }, make("label", {}, "Upwards ", choices[0]), make("label", {}, "To the right ", choices[1]));
  if (strong.length < names.length) {
    all.addEventListener("change", () => show(all.checked));
    controls.append(make("label", {}, all, ` all ${names.length}, also those without a correlation of 0.3`));
  }
  function show(whole) {
    all.checked = whole;
    shown = whole ? names.map((_, i) => i) : strong;
    cell = pair && pair.every((i) => shown.includes(i)) ? pair.map((i) => shown.indexOf(i)) : [1, 0];
    label();
    paint();
  }

  function label() {
    canvas.setAttribute("aria-label", `Correlations of ${shown.length} parameters; arrows move from pair to pair, Enter opens its draws`);
  }
  label();
  const strongest = shown.flatMap((i, row) => shown.slice(0, row).map((j, column) => [Math.abs(rho(i, j)), row, column]));
  box.append(make("p", { class: "words" }, "A click on a cell opens the draws of its pair."), controls, make("div", { class: "beside" }, map, scatter));
  if (strongest.length) {
    const [, row, column] = strongest.reduce((best, one) => (one[0] > best[0] ? one : best));
    select([row, column], true);
  } else paint();
  new ResizeObserver(paint).observe(map);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
});
