// Intervals of the coefficients: a table whose rows are drawn, as ratios, as values, or with their dimensions.
widget("coefficients", (box) => {
  const { rows, sets } = content.intervals;
  const inner = rows.flatMap((row, k) => {
    const all = [...row.prior, ...row.posterior, ...sets.flatMap(({ values }) => values[k])];
    return row.reference ? all.filter((value) => value !== null).map((value) => value / row.reference) : [];
  });
  const limits = [Math.max(Math.min(...inner, 1) - 0.1, -1.5), Math.min(Math.max(...inner, 1) + 0.1, 4)];
  const shows = [["ratio", `ratio to the ${content.word}`], ["value", rows.some((row) => row.unit) ? "value" : "non-dimensional value"]];
  if (rows.some((row) => row.si_factor && row.si_unit)) shows.push(["dimensional", "value in SI units"]);
  const cells = rows.map((row) => ({ bar: make("td", { class: "interval" }), words: make("td") }));
  const scale = make("span", { class: "interval", "aria-hidden": "true" });
  const about = make("p", { class: "words", "aria-live": "polite" });

  // Ratios share an axis; a coefficient that is zero there, and values, have one of their own: that of their prior.
  function span(row, show) {
    if (show === "ratio" && row.reference) return limits;
    const [low, high] = row.prior;
    const edges = [Math.min(low, row.posterior[0]), Math.max(high, row.posterior[4])];
    return [edges[0] - 0.25 * (edges[1] - edges[0]), edges[1] + 0.25 * (edges[1] - edges[0])];
  }

  function draw(row, k, show) {
    const ratio = show === "ratio" && row.reference;
    const factor = ratio ? 1 / row.reference : show === "dimensional" ? row.si_factor ?? 1 : 1;
    const [low, high] = span(row, show);
    const place = (value) => Math.min(100, Math.max(0, (100 * ((ratio ? value / row.reference : value) - low)) / (high - low)));
    const bar = (a, b, thickness, name) => {
      const [from, to] = [place(a), place(b)].sort((one, other) => one - other);
      return make("rect", { x: `${from}%`, width: `${Math.max(to - from, 0.3)}%`, y: 10 - thickness / 2, height: thickness, class: name });
    };
    const mark = place(row.reference);
    const [q5, q25, q50, q75, q95] = row.posterior;
    const found = sets.flatMap(({ method, values }) => values[k].filter((value) => value !== null).map((value) => {
      const beyond = [0, 100].includes(place(value)) ? " beyond" : "";
      return make("circle", { cx: `${place(value)}%`, cy: 10, r: 2.6, class: (method === "SQP" ? "sqp" : "linear") + beyond });
    }));
    cells[k].bar.replaceChildren(make("svg", { height: 20, "aria-hidden": "true" },
      bar(...row.prior, 14, "prior"), make("line", { x1: `${mark}%`, x2: `${mark}%`, y1: 0, y2: 20, class: "reference" }),
      bar(q5, q95, 3, "posterior"), bar(q25, q75, 8, "posterior"), found));
    const unit = ratio ? "" : show === "dimensional" ? row.si_unit ?? row.unit : row.unit;
    const sd = Math.abs(factor) * (q95 - q5) / 3.29;
    const [lower, upper] = [factor * q5, factor * q95].sort((one, other) => one - other);
    cells[k].words.textContent = `${rounded(factor * q50, sd)} (${rounded(lower, sd)} to ${rounded(upper, sd)})${unit ? ` ${unit}` : ""}`;
    cells[k].words.dataset.sort = factor * q50;
  }

  function choose(show) {
    rows.forEach((row, k) => draw(row, k, show));
    const ticks = show === "ratio" ? [-1, -0.5, 0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4].filter((v) => limits[1] - limits[0] < 3 || Number.isInteger(v)).filter((v) => v > limits[0] && v < limits[1]) : [];
    const place = (value) => `${(100 * (value - limits[0])) / (limits[1] - limits[0])}%`;
    scale.replaceChildren(make("svg", { height: 16 }, ticks.map((v) => make("text", { x: place(v), y: 13 }, String(v).replace("-", "\u2212")))));
    about.textContent = show === "ratio"
      ? "One axis for all" + (rows.some((row) => !row.reference) ? `, but where the ${content.word} is zero: there the value on a scale of its own.` : ".")
      : "Each row has a scale of its own, that of its prior.";
  }

  const choice = make("fieldset", {}, make("legend", {}, "Show"));
  for (const [show, words] of shows) {
    const input = make("input", { type: "radio", name: "show", value: show });
    input.checked = show === "ratio";
    input.addEventListener("change", () => choose(show));
    choice.append(make("label", {}, input, ` ${words}`));
  }
  const heads = ["coefficient", "axis", "interval", "posterior / prior sd", "median (90 % interval)"];
  const head = (words, k) => make("th", { scope: "col", "aria-sort": "none", class: [null, "axis", "plain", null, null][k] }, words, k === 2 ? scale : []);
  const body = rows.map((row, k) => {
    const name = make("td", { title: row.meaning }, row.name, " ");
    const symbol = make("span", { class: "symbol" });
    symbol.innerHTML = row.symbol;
    name.append(symbol);
    const line = make("tr", { "data-words": `${row.name} ${row.axis} ${row.meaning}` }, name, make("td", { class: "axis", "data-sort": String(k).padStart(4, "0") }, row.axis),
      cells[k].bar, make("td", {}, row.contraction.toFixed(3)), cells[k].words);
    const factor = row.reference ? 1 / row.reference : 1;
    const range = (values) => [values[0] * factor, values[values.length - 1] * factor].sort((a, b) => a - b).map((v) => Number(v.toPrecision(4))).join(" to ");
    const words = `${row.name}: ${row.meaning}. 90 % of the prior ${range(row.prior)}, of the posterior ${range(row.posterior)}${row.reference ? ` of the ${content.word}` : ""}`;
    cells[k].bar.addEventListener("pointermove", (event) => point(event, words));
    cells[k].bar.addEventListener("pointerleave", (event) => point(event, ""));
    return line;
  });
  const methods = [...new Set(sets.map(({ method }) => method))];
  box.append(
    choice, about,
    make("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": "Intervals of the coefficients, table" },
      make("table", { class: "sortable intervals" }, make("thead", {}, make("tr", {}, heads.map(head))), make("tbody", {}, body))),
    legend([["prior", "90 % of the prior"], ["posterior", "50 and 90 % of the posterior"], ["reference", content.word],
      ...methods.map((method) => [method === "SQP" ? "sqp" : "linear", `${method}, hollow beyond the axis`])]),
  );
  choose("ratio");
});
