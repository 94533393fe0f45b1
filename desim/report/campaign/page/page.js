"use strict";
// Tables sort by the column whose head is clicked; once more turns the order round.
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  const value = (row, i) => {
    const cell = row.cells[i];
    return cell.classList.contains("num") ? parseFloat(cell.dataset.v ?? "NaN") : cell.textContent;
  };
  heads.forEach((head, i) => head.firstElementChild.addEventListener("click", () => {
    const sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    heads.forEach((other) => other.setAttribute("aria-sort", "none"));
    head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
    const order = (a, b) => {
      const x = value(a, i), y = value(b, i);
      if (typeof x === "string") return sign * x.localeCompare(y, "en", {numeric: true});
      return Number.isNaN(x) || Number.isNaN(y) ? Number.isNaN(x) - Number.isNaN(y) : sign * (x - y);
    };
    const body = table.tBodies[0];
    body.append(...[...body.rows].sort(order));
  }));
}
