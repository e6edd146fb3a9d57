// Tables sort by their heads, and long ones can be searched. A cell may say by what it sorts, a row what it is found by.
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
  if (body.rows.length <= LONG) continue;
  const label = document.createElement("label"), input = document.createElement("input"), count = document.createElement("output");
  label.className = "search";
  input.type = "search";
  label.append("Search ", input, " ", count);
  table.parentElement.before(label);
  input.addEventListener("input", () => {
    const wanted = input.value.trim().toLowerCase().split(/\s+/);
    const found = [...body.rows].filter((row) => {
      const words = `${row.textContent} ${row.dataset.words ?? ""}`.toLowerCase();
      row.hidden = !wanted.every((word) => words.includes(word));
      return !row.hidden;
    });
    count.textContent = input.value.trim() ? `${found.length} of ${body.rows.length}` : "";
  });
}
