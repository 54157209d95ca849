// A node's parameters: a control for each, and the node's own reason where it refuses a value.

const PACE = 200; // ms between two changes at least: a slider's key that is held makes thirty a second

const view = {
  label: "Parameter panel",
  start(stage, send) {
    const title = make("h4", { class: "rosview-title" });
    const grid = make("div", { class: "rosform-grid" });
    const problem = make("p", { class: "rosform-problem", role: "alert" });
    const none = make("p", { hidden: true },
      "This node has declared no parameters: declare_parameter(…) makes one.");
    stage.append(title, none, grid, problem);
    const rows = new Map();
    let known = "";
    return {
      draw(frame) {
        title.textContent = frame.title;
        const shape = JSON.stringify(frame.entries.map(({ value, ...rest }) => rest));
        if (shape !== known) {
          known = shape;
          rows.clear();
          grid.replaceChildren(...frame.entries.flatMap((entry) => {
            const made = row(entry, newId(), send);
            rows.set(entry.name, made);
            return made.elements;
          }));
        }
        for (const entry of frame.entries) rows.get(entry.name).draw(entry.value, frame.changes);
        none.hidden = frame.entries.length > 0;
        if (problem.textContent !== frame.problem) problem.textContent = frame.problem;
      },
    };
  },
};

function row(entry, id, send) {
  const slider = entry.kind === "slider";
  let drawn = -1; // answers of the node that were drawn, and that must come before more is drawn
  let awaited = 0;
  let sent = -PACE; // when the last change was
  let later = 0;
  const set = () => {
    later = 0;
    sent = performance.now();
    awaited = Math.max(awaited, drawn) + 1;
    send({ set: entry.name, value: valueOf(input) });
  };
  const input = make("input", {
    id, type: slider ? "range" : entry.kind === "checkbox" ? "checkbox" : "text",
    min: entry.least, max: entry.most,
    step: slider ? entry.step ?? "any" : null,
    disabled: entry.read_only, "aria-describedby": `${id}-about`, spellcheck: "false",
    onchange: () => {
      if (later) return; // the one that is to be sent sends what stands there then
      const rest = slider ? sent + PACE - performance.now() : 0;
      if (rest > 0) later = setTimeout(set, rest);
      else set();
    },
  });
  const shown = make("output", { for: id, class: "rosparam-value" });
  input.addEventListener("input", () => { if (slider) shown.textContent = input.value; });
  const about = [entry.description, range(entry), entry.read_only ? "read only" : ""]
    .filter(Boolean).join("; ");
  return {
    elements: [
      make("label", { for: id }, entry.name),
      make("span", {}, input, slider ? shown : "",
        make("span", { class: "rosform-takes", id: `${id}-about` }, about)),
    ],
    draw(value, changes) {
      // What somebody is typing, or moving, is left alone until the node has answered to it all.
      const answered = drawn;
      drawn = Math.max(drawn, changes);
      if (later) return;
      if (document.activeElement === input && (changes < awaited || (answered === changes && !slider))) return;
      if (input.type === "checkbox") input.checked = value === true;
      else if (document.activeElement !== input || !slider || !input.matches(":active")) {
        input.value = String(value ?? "");
      }
      shown.textContent = String(value ?? "");
    },
  };
}

function range(entry) {
  return entry.least === null ? "" : `${entry.least} to ${entry.most}`;
}

export default { render };
