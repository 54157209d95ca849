// Two profiles side by side with the DDS rule of each policy; predict, run, compare.

const POLICIES = ["reliability", "durability", "history", "depth", "deadline", "lifespan", "liveliness", "lease"];
const UNITS = { depth: "messages", deadline: "s, 0: none", lifespan: "s, 0: none", lease: "s, 0: none" };

const view = {
  label: "QoS lab",
  start(stage, send) {
    const id = newId();
    let parts = null;
    return {
      draw(frame) {
        parts ??= build(stage, frame, id, send);
        parts.draw(frame);
      },
    };
  },
};

function build(stage, frame, id, send) {
  const sides = { offered: {}, requested: {} };
  const rows = POLICIES.map((policy) => make(
    "tr", {}, make("th", { scope: "row" }, policy),
    ...Object.keys(sides).map((side) => {
      const input = control(policy, frame, side, `${side} ${policy}`);
      sides[side][policy] = input;
      return make("td", {}, input);
    }),
    make("td", { class: "rosform-takes" }, UNITS[policy] ?? ""),
  ));
  const profiles = make(
    "table", { class: "rostable roslab-profiles" },
    make("thead", {}, make("tr", {},
      ...["policy", "writer offers", "reader requests", "unit"].map((name) => make("th", { scope: "col" }, name)))),
    make("tbody", {}, ...rows),
  );
  const loss = make("input", {
    id: `${id}-loss`, type: "number", min: 0, max: 90, step: 5, value: 0,
    disabled: Boolean(frame.no_loss), title: frame.no_loss || null,
  });
  const connects = make(
    "select", { id: `${id}-connects` },
    make("option", { value: "" }, "choose…"), make("option", { value: "yes" }, "connect"),
    make("option", { value: "no" }, "not connect"),
  );
  const arrive = make("input", { id: `${id}-arrive`, type: "number", min: 0, max: frame.count, placeholder: "?" });
  const problem = make("p", { class: "rosform-problem", role: "alert" });
  const state = make("p", { class: "roslab-state", role: "status" });
  const results = make("ol", { class: "roslab-results" });
  let running = false;
  const ask = (scenario) => {
    if (running) return;
    // What is no number has no value, which would be taken for 0.
    const unread = [...form.querySelectorAll("input")].find((input) => input.validity.badInput);
    if (unread) {
      problem.textContent = "That is no number: type one, or leave it empty.";
      unread.focus();
      return;
    }
    if (!connects.value) {
      problem.textContent = "Predict first: will they connect?";
      connects.focus();
      return;
    }
    problem.textContent = "";
    send({ run: {
      offered: profileOf(sides.offered), requested: profileOf(sides.requested),
      scenario, loss: Number(loss.value) || 0,
      connects: connects.value === "yes",
      arrive: arrive.value === "" ? null : Number(arrive.value),
    } });
  };
  const buttons = Object.keys(frame.scenarios).map((name, number) => make(
    "button", { type: "button", "aria-describedby": `${id}-about-${number}`, onclick: () => ask(name) },
    `Run ${name}`,
  ));
  const form = make(
    "form", { onsubmit: (event) => event.preventDefault() },
    profiles,
    make("p", {}, make("label", { for: loss.id }, "The link loses "), loss, " % ",
      make("span", { class: "rosform-takes" }, frame.no_loss)),
    make("p", {}, make("label", { for: connects.id }, "I predict that they will "), connects,
      make("label", { for: arrive.id }, " and that so many arrive: "), arrive, ` of ${frame.count}`),
    make("div", { class: "roslab-scenarios", role: "group", "aria-label": "Scenarios" },
      ...Object.values(frame.scenarios).flatMap((about, number) => [
        buttons[number], make("span", { class: "rosform-takes", id: `${id}-about-${number}` }, about),
      ])),
    problem, state,
  );
  stage.append(form, results);
  let known = "";
  return {
    draw(latest) {
      running = latest.running;
      // Not disabled: that would take the keyboard's focus away from the one that was pressed.
      for (const button of buttons) button.setAttribute("aria-disabled", String(running));
      const said = latest.running ? "Running…" : "";
      if (state.textContent !== said) state.textContent = said;
      if (latest.problem) problem.textContent = latest.problem;
      const trials = JSON.stringify(latest.trials);
      if (trials !== known) {
        known = trials;
        results.replaceChildren(...latest.trials.map((trial) => result(trial, latest.count)));
      }
    },
  };
}

function control(policy, frame, side, label) {
  const value = frame[side][policy];
  if (frame.choices[policy]) {
    const select = make("select", { "aria-label": label },
      ...frame.choices[policy].map((name) => make("option", { value: name }, name)));
    select.value = value;
    return select;
  }
  const [least, most] = frame.numbers[policy];
  return make("input", {
    type: "number", "aria-label": label, min: least, max: most, value,
    step: policy === "depth" ? 1 : "any",
  });
}

function profileOf(inputs) {
  return Object.fromEntries(Object.entries(inputs).map(
    ([policy, input]) => [policy, input.tagName === "SELECT" ? input.value : Number(input.value)],
  ));
}

function result(trial) {
  const got = new Set(trial.received);
  const dots = make(
    "span", { class: "roslab-dots", role: "img", "aria-label": `${got.size} of ${trial.sent} messages` },
    ...Array.from({ length: trial.sent }, (_, number) => make(
      "span", { class: got.has(number) ? "roslab-got" : "roslab-lost", title: `message ${number}` },
    )),
  );
  return make(
    "li", {},
    make("strong", {}, trial.title), ` (${trial.pair}): ${trial.seen} `, dots,
    make("p", {}, trial.why),
    make("p", { class: trial.right ? "rosgood" : "rosbad" }, trial.verdict),
    make("details", {}, make("summary", {}, "Policy by policy"),
      make("table", { class: "rostable" }, make("tbody", {}, ...trial.rules.map((rule) => make(
        "tr", {}, make("th", { scope: "row" }, rule.policy), make("td", {}, rule.offered),
        make("td", {}, rule.requested),
        make("td", { class: rule.fits ? "rosgood" : "rosbad" }, rule.fits ? "fits" : "does not fit"),
        make("td", {}, rule.rule),
      ))))),
  );
}

export default { render };
