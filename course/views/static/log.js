// What all nodes said. Level and text filter what is here at once; the kernel looks through the rest
// of what it keeps, and sends the latest lines that pass.

const LEVELS = { DEBUG: 10, INFO: 20, PRINT: 20, WARN: 30, STDERR: 30, ERROR: 40, FATAL: 50 };

const view = {
  label: "Log panel",
  start(stage, send) {
    const ask = () => {
      redraw();
      send({ filter: { level: level.value, search: search.value } });
    };
    const level = make(
      "select", { "aria-label": "Lowest level", onchange: ask },
      ...["DEBUG", "INFO", "WARN", "ERROR", "FATAL"].map((name) => make("option", { value: name }, name)),
    );
    const search = make("input", {
      type: "search", "aria-label": "Search", placeholder: "Search", oninput: ask,
    });
    // No status: it changes with every line, and a screen reader would say nothing else. It belongs
    // to the filters, and is read out with them.
    const count = make("span", { class: "rosform-takes", id: newId() });
    for (const filter of [level, search]) filter.setAttribute("aria-describedby", count.id);
    const rows = make("tbody");
    const box = make(
      "div", { class: "roslog", tabindex: "0", role: "log", "aria-live": "off" },
      make("table", { class: "rostable" }, rows),
    );
    stage.append(make("div", {}, level, " ", search, count), box);
    let frame = { rows: [], found: 0, total: 0 };
    let chosen = "";
    let following = true; // the end, until somebody scrolls up to read
    box.addEventListener("scroll", () => {
      following = box.scrollTop + box.clientHeight >= box.scrollHeight - 8;
    });
    const redraw = () => {
      const least = LEVELS[level.value];
      const wanted = search.value.toLowerCase();
      const found = frame.rows.filter((row) => (LEVELS[row[1]] ?? 20) >= least
        && (!wanted || row.join(" ").toLowerCase().includes(wanted)));
      update(rows, found);
      if (following) requestAnimationFrame(() => { box.scrollTop = box.scrollHeight; });
      const said = `the last ${found.length} of ${frame.found} ${frame.found === 1 ? "line" : "lines"} (${frame.total} in all)`;
      if (count.textContent !== said) count.textContent = said;
    };
    return {
      draw(latest) {
        frame = latest;
        const theirs = JSON.stringify([latest.level, latest.search]);
        if (theirs !== chosen) { // chosen in another window on this view, or before a reload
          chosen = theirs;
          if (document.activeElement !== search) search.value = latest.search;
          level.value = latest.level;
        }
        redraw();
      },
    };
  },
};

/** Bring the table up to date; a line that stays is left alone, as somebody may read or copy it. */
function update(rows, found) {
  const known = new Map();
  for (const element of rows.children) known.set(element.dataset.key, element);
  const times = new Map(); // lines that are alike in all are told apart by their number
  const wanted = found.map((row) => {
    const line = JSON.stringify(row);
    times.set(line, (times.get(line) ?? 0) + 1);
    const key = `${line} ${times.get(line)}`;
    return known.get(key) ?? make(
      "tr", { class: `roslog-${row[1].toLowerCase()}`, "data-key": key },
      ...row.map((cell) => make("td", {}, cell)),
    );
  });
  const kept = new Set(wanted);
  for (const element of known.values()) if (!kept.has(element)) element.remove();
  let place = rows.firstElementChild;
  for (const element of wanted) {
    if (element === place) place = place.nextElementSibling;
    else rows.insertBefore(element, place);
  }
}

export default { render };
