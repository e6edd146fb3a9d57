// Intervals of the parameters, drawn in the rows of their table, of which one group of columns is shown at a time.
widget("coefficients", () => {
  const { rows, sets } = content.intervals;
  const table = document.getElementById("coefficients-table");
  const inner = rows.flatMap((row, k) => {
    const all = [...row.prior, ...row.posterior, ...sets.flatMap(({ values }) => values[k] ?? [])];
    return row.reference ? all.filter((value) => value !== null).map((value) => value / row.reference) : [];
  });
  const limits = [Math.max(Math.min(...inner, 1) - 0.1, -1.5), Math.min(Math.max(...inner, 1) + 0.1, 4)];

  // Ratios share an axis; a parameter without one has an axis of its own, that of its prior.
  function span({ reference, prior, posterior }) {
    if (reference) return limits;
    const edges = [Math.min(prior[0], posterior[0]), Math.max(prior[1], posterior[4])];
    return [edges[0] - 0.25 * (edges[1] - edges[0]), edges[1] + 0.25 * (edges[1] - edges[0])];
  }

  function drawn(row, k) {
    const [low, high] = span(row);
    const place = (value) => Math.min(100, Math.max(0, (100 * (value / (row.reference || 1) - low)) / (high - low)));
    const bar = (a, b, thickness, name) => {
      const [from, to] = [place(a), place(b)].sort((one, other) => one - other);
      return make("rect", { x: `${from}%`, width: `${Math.max(to - from, 0.3)}%`, y: 10 - thickness / 2, height: thickness, class: name });
    };
    const mark = place(row.reference ?? row.value);
    const [q5, q25, , q75, q95] = row.posterior;
    const found = sets.flatMap(({ method, values }) => (values[k] ?? []).filter((value) => value !== null).map((value) => {
      const beyond = [0, 100].includes(place(value)) ? " beyond" : "";
      return make("circle", { cx: `${place(value)}%`, cy: 10, r: 2.6, class: (method === "SQP" ? "sqp" : "linear") + beyond });
    }));
    return make("svg", { height: 20, "aria-hidden": "true" },
      bar(...row.prior, 14, "prior"), make("line", { x1: `${mark}%`, x2: `${mark}%`, y1: 0, y2: 20, class: "reference" }),
      bar(q5, q95, 3, "posterior"), bar(q25, q75, 8, "posterior"), found);
  }

  const ticks = [-1, -0.5, 0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4].filter((v) => (limits[1] - limits[0] < 3 || Number.isInteger(v)) && v > limits[0] && v < limits[1]);
  const scale = make("svg", { height: 16, "aria-hidden": "true" },
    ticks.map((v) => make("text", { x: `${(100 * (v - limits[0])) / (limits[1] - limits[0])}%`, y: 13 }, String(v).replace("-", "\u2212"))));
  table.tHead.rows[0].cells[0].after(make("th", { scope: "col", class: "plain" }, `ratio to the ${content.word}`, make("span", { class: "interval" }, scale)));
  rows.forEach((row, k) => {
    const line = document.getElementById(`row-${row.name}`);
    const cell = make("td", { class: "interval" }, drawn(row, k));
    const range = (values) => [values[0], values[values.length - 1]].map((v) => v / (row.reference || 1)).sort((a, b) => a - b).map((v) => Number(v.toPrecision(4))).join(" to ");
    const words = `${line.cells[0].textContent.trim()}${line.dataset.words ? `, ${line.dataset.words}` : ""}: 90 % of the prior ${range(row.prior)}, of the posterior ${range(row.posterior)}${row.reference ? ` of the ${content.word}` : ""}`;
    cell.addEventListener("pointermove", (event) => point(event, words));
    cell.addEventListener("pointerleave", (event) => point(event, ""));
    line.cells[0].after(cell);
  });

  const groups = [["value", "values"], ["si", "SI units"], ["prior", "prior"], ["others", "others known"], ["sampling", "sampling"], ["meaning", "meaning"]]
    .filter(([group]) => table.querySelector(`th.${group}`));
  const choice = make("fieldset", {}, make("legend", {}, "Columns"));
  for (const [group, words] of groups) {
    const input = make("input", { type: "radio", name: "show", value: group });
    input.checked = group === "value";
    input.addEventListener("change", () => { table.dataset.show = group; });
    choice.append(make("label", {}, input, ` ${words}`));
  }
  table.dataset.show = "value";
  const methods = [...new Set(sets.map(({ method }) => method))];
  return [choice, legend([["prior", "90 % of the prior"], ["posterior", "50 and 90 % of the posterior"], ["reference", content.word],
    ...methods.map((method) => [method === "SQP" ? "sqp" : "linear", `${method}, hollow beyond the axis`])])];
});
