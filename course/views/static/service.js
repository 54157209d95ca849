// A service's form, and its latest calls with their answers.

const view = {
  label: "Service console",
  start(stage, send) {
    const title = make("h4", { class: "rosview-title" });
    const form = formFor("Request", "Call", (values) => send({ call: values }));
    const rows = make("tbody");
    const table = make(
      "table", { class: "rostable" },
      make("thead", {}, make("tr", {}, ...["#", "request", "answer", "time"].map(
        (name) => make("th", { scope: "col" }, name),
      ))),
      rows,
    );
    stage.append(title, form.element, make("div", { "aria-live": "polite" }, table));
    return {
      draw(frame) {
        title.textContent = frame.title;
        form.draw(frame.fields, frame.problem);
        table.hidden = frame.calls.length === 0;
        rows.replaceChildren(...frame.calls.map((call) => make(
          "tr", {},
          make("td", {}, String(call.number)),
          make("td", {}, asText(call.request)),
          make("td", { class: call.problem ? "rosbad" : "" },
            call.problem || (call.answer ? asText(call.answer) : "waiting…")),
          make("td", {}, call.time),
        )));
      },
    };
  },
};

export default { render };
