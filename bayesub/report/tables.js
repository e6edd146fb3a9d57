// Tables sort by their heads and are searched together. A cell may say by what it sorts, a row what it is found by.
const LONG = 10; // rows
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells], body = table.tBodies[0];
  heads.forEach((head, column) => {
    if (head.matches(".plain")) return;
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const sign = head.ariaSort === "ascending" ? -1 : 1;
      for (const other of heads) other.ariaSort = "none";
      head.ariaSort = sign > 0 ? "ascending" : "descending";
      const text = (row) => row.cells[column].dataset.sort ?? row.cells[column].textContent.trim().replace("\u2212", "-");
      const number = (row) => { const value = parseFloat(text(row)); return Number.isNaN(value) ? Infinity : value; };
      const order = (a, b) => (number(a) === number(b) ? text(a).localeCompare(text(b)) : number(a) - number(b));
      body.append(...[...body.rows].sort((a, b) => sign * order(a, b)));
    });
  });
}

// One search for the page: of tables that are long or whose rows have words, those rows stay that have all of what is asked for.
const searched = [...document.querySelectorAll("table.sortable")].filter(({ tBodies: [body] }) => body.rows.length > LONG || body.querySelector("[data-words]"));
if (searched.length) {
  const label = document.createElement("label"), input = document.createElement("input"), count = document.createElement("output");
  label.className = "search";
  input.type = "search";
  label.append("Search ", input, " ", count);
  document.querySelector("nav").append(label);
  const opened = new Set();
  input.addEventListener("input", () => {
    const wanted = input.value.trim().toLowerCase().split(/\s+/);
    let total = 0;
    for (const table of searched) {
      const rows = [...table.tBodies[0].rows];
      const found = rows.filter((row) => wanted.every((word) => `${row.textContent} ${row.dataset.words ?? ""}`.toLowerCase().includes(word)));
      rows.forEach((row) => { row.hidden = found.length > 0 && !found.includes(row); });
      const fold = table.closest("details");
      if (fold && input.value.trim() && found.length && !fold.open) opened.add(fold);
      if (fold && opened.has(fold)) fold.open = Boolean(input.value.trim()) && found.length > 0;
      total += found.length;
    }
    count.textContent = input.value.trim() ? `${total} rows` : "";
  });
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter") searched.find((table) => table.querySelector("tr[hidden]"))?.scrollIntoView({ block: "center" });
  });
}
