// An action's form, and its goals: states passed, feedback, result, and a button that cancels.

const view = {
  label: "Action view",
  start(stage, send) {
    const title = make("h4", { class: "rosview-title" });
    const form = formFor("Goal", "Send goal", (values) => send({ goal: values }));
    const list = make("ul", { class: "rosgoals" });
    stage.append(title, form.element, list);
    const cards = new Map();
    return {
      draw(frame) {
        title.textContent = frame.title;
        form.draw(frame.fields, frame.problem);
        for (const goal of frame.goals) {
          if (!cards.has(goal.number)) cards.set(goal.number, card(goal.number, send));
          cards.get(goal.number).draw(goal);
        }
        const kept = frame.goals.map((goal) => goal.number).reverse();
        for (const number of cards.keys()) if (!kept.includes(number)) cards.delete(number);
        const elements = kept.map((number) => cards.get(number).element);
        // Moving an element takes its focus away: only when the list itself has changed.
        if (elements.some((element, place) => list.children[place] !== element)
            || list.children.length !== elements.length) {
          list.replaceChildren(...elements);
        }
      },
    };
  },
};

/** A goal's card is kept from frame to frame, so that its button keeps the focus. */
function card(number, send) {
  const states = make("ol", { class: "rosstates" });
  const text = make("p", { class: "rosgoal-text" });
  const way = make("p", { class: "rosgoal-way" });
  const state = make("p", { class: "rosgoal-state", role: "status" });
  const cancel = make(
    "button", { type: "button", "aria-label": `Cancel goal ${number}`,
      onclick: () => send({ cancel: number }) }, "Cancel",
  );
  const element = make(
    "li", { class: "rosgoal", tabindex: "-1" }, make("strong", {}, `Goal ${number}`), states, text, way, state, cancel,
  );
  return {
    element,
    draw(goal) {
      states.replaceChildren(...goal.states.map(([name, when], place) => make(
        "li", { class: `rosstate rosstate-${name.toLowerCase()}`,
          "aria-current": place === goal.states.length - 1 ? "step" : null },
        `${name} ${when}`,
      )));
      text.textContent = goal.text.join("\n");
      way.replaceChildren(...(goal.way ? [...line(goal.way), goal.way.text] : []));
      if (state.textContent !== goal.outcome) state.textContent = goal.outcome;
      state.className = `rosgoal-state ${goal.bad ? "rosbad" : ""}`;
      // The button goes with the goal's end: its focus stays in the view, where the result is.
      if (goal.over && document.activeElement === cancel) element.focus();
      cancel.hidden = goal.over;
    },
  };
}

const WAY = { width: 120, height: 24 };

/** How far a goal has come, from feedback to feedback, as a small line; one point makes none. */
function line({ points }) {
  if (points.length < 2) return [];
  const svg = shape("svg", { ...WAY, viewBox: `0 0 ${WAY.width} ${WAY.height}`, "aria-hidden": "true" });
  const [times, values] = [0, 1].map((part) => points.map((point) => point[part]));
  const scaled = (all, room) => {
    const least = Math.min(...all);
    const span = Math.max(...all) - least || 1;
    return all.map((value) => 2 + (value - least) / span * (room - 4));
  };
  const [x, y] = [scaled(times, WAY.width), scaled(values, WAY.height)];
  svg.append(shape("polyline", {
    points: points.map((_, place) => `${x[place].toFixed(1)},${(WAY.height - y[place]).toFixed(1)}`).join(" "),
  }));
  return [svg];
}

export default { render };
