// What all nodes said: filtered by level and text here, so that a flood needs no round trip.

const LEVELS = { DEBUG: 10, INFO: 20, PRINT: 20, WARN: 30, STDERR: 30, ERROR: 40, FATAL: 50 };

const view = {
  label: "Log panel",
  start(stage) {
    const level = make(
      "select", { "aria-label": "Lowest level", onchange: () => redraw() },
      ...["DEBUG", "INFO", "WARN", "ERROR"].map((name) => make("option", { value: name }, name)),
    );
    level.value = "INFO";
    const search = make("input", {
      type: "search", "aria-label": "Search", placeholder: "Search", oninput: () => redraw(),
    });
    const count = make("span", { class: "rosform-takes", role: "status" });
    const rows = make("tbody");
    const box = make(
      "div", { class: "roslog", tabindex: "0", role: "log", "aria-live": "off" },
      make("table", { class: "rostable" }, rows),
    );
    stage.append(make("div", {}, level, " ", search, count), box);
    let frame = { rows: [], total: 0 };
    let following = true; // the end, until somebody scrolls up to read
    box.addEventListener("scroll", () => {
      following = box.scrollTop + box.clientHeight >= box.scrollHeight - 8;
    });
    const redraw = () => {
      const least = LEVELS[level.value];
      const wanted = search.value.toLowerCase();
      const found = frame.rows.filter((row) => (LEVELS[row[1]] ?? 20) >= least
        && (!wanted || row.join(" ").toLowerCase().includes(wanted)));
      rows.replaceChildren(...found.map((row) => make(
        "tr", { class: `roslog-${row[1].toLowerCase()}` },
        ...row.map((cell) => make("td", {}, cell)),
      )));
      if (following) requestAnimationFrame(() => { box.scrollTop = box.scrollHeight; });
      const said = `${found.length} of the last ${frame.rows.length} lines`;
      if (count.textContent !== said) count.textContent = said;
    };
    return { draw(latest) { frame = latest; redraw(); } };
  },
};

export default { render };
