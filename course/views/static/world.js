// A world from above with its controls: buttons, the arrow keys, the pointer.

const HELP =
  "Arrow keys drive: hold one, and let go to stop. Space presses the emergency stop. Drag an " +
  "obstacle, or move the chosen one by Shift and arrows; a double click adds one, Delete removes it.";

const view = {
  label: "World",
  start(stage, send) {
    let parts = null;
    return {
      draw(frame) {
        parts ??= build(stage, frame, send);
        parts.draw(frame);
      },
      stop: () => parts?.stop(),
    };
  },
};

function build(stage, first, send) {
  const act = (message) => stage.disabled || send(message);
  const painter = floorPainter(first.floor);
  const state = { frame: first, chosen: null, dragged: null, recent: [], trail: null };
  const bar = toolbar(state, act);
  const obstacles = obstaclePicker(state, act, painter);
  const facts = factList();
  const faults = faultButtons(first.floor.faults, act);
  const topics = topicTable(act);
  const news = make("ul", { class: "rosworld-news" });
  const problem = make("p", { class: "rosform-problem", role: "alert" });
  const pointer = make("span", { class: "rosworld-pointer" });
  const id = newId();
  for (const [name, value] of Object.entries({
    tabindex: 0, role: "application", "aria-label": `${first.floor.name} from above`,
    "aria-describedby": id,
  })) painter.canvas.setAttribute(name, value);
  const halt = driveByKeys(painter.canvas, state, act, obstacles, bar);
  dragObstacles(painter, state, act, obstacles, pointer);
  stage.append(make(
    "div", { class: "rosworld" },
    bar.element,
    make("div", { class: "rosworld-main" },
      make("div", { class: "rosworld-left" },
        painter.element,
        make("p", { class: "rosworld-legend" },
          mark("beam", "LIDAR"), mark("trail", "trail"), mark("path", "planned path"),
          mark("found", "obstacles that your nodes found"), pointer),
        make("p", { class: "rosworld-help", id }, HELP),
        obstacles.element, problem),
      make("div", { class: "rosworld-right" },
        facts.element, faults.element, make("p", { class: "rosworld-head" }, "News"),
        make("div", { role: "log", "aria-label": "News" }, news))),
    make("details", {}, make("summary", {}, "What the topics carry"), topics.element),
  ));
  return {
    draw(frame) {
      state.frame = frame;
      bar.draw(frame);
      obstacles.draw(frame);
      facts.draw(frame);
      faults.draw(frame);
      topics.draw(frame.topics);
      const lines = frame.news.length ? frame.news : ["Nothing yet."];
      if (news.textContent !== lines.join("")) {
        news.replaceChildren(...lines.map((text) => make("li", {}, text)));
      }
      say(problem, frame.problem);
      painter.draw(withTrail(state, frame), { chosen: state.chosen });
    },
    stop() {
      halt();
      painter.stop();
    },
  };
}

/** The frame as it is drawn: its trail up to now, and an obstacle where it is being dragged. */
function withTrail(state, frame) {
  if (state.trail !== frame.trail && JSON.stringify(state.trail) !== JSON.stringify(frame.trail)) {
    state.recent = [];
  }
  state.trail = frame.trail;
  if (frame.trail.length) state.recent.push([frame.robot.x, frame.robot.y]);
  const moved = state.dragged;
  return {
    ...frame, trail: [...frame.trail, ...state.recent],
    obstacles: !moved ? frame.obstacles
      : frame.obstacles.map((row) => row[0] === moved.id ? [row[0], moved.x, moved.y, row[3]] : row),
  };
}

function factList() {
  const rows = ["Place", "Heading", "Speed", "Battery", "Gripper", "Bumper"];
  const values = Object.fromEntries(rows.map((name) => [name, make("dd", {})]));
  const level = make("meter", { min: 0, max: 1, low: 0.25, high: 0.5, optimum: 1, "aria-label": "Battery" });
  const percent = make("span", {});
  values.Battery.append(level, percent);
  return {
    element: make("dl", { class: "rosworld-facts" },
      ...rows.flatMap((name) => [make("dt", {}, name), values[name]])),
    draw({ robot }) {
      say(values.Place, `x ${robot.x.toFixed(2)} m, y ${robot.y.toFixed(2)} m`);
      say(values.Heading, `${(Math.round(robot.yaw * 180 / Math.PI) + 360) % 360}°`);
      say(values.Speed, `${robot.speed.toFixed(2)} m/s, ${robot.turn.toFixed(2)} rad/s`);
      say(percent, ` ${Math.round(robot.battery * 100)} %`);
      level.value = robot.battery;
      say(values.Gripper, `${robot.gripper}, ${robot.holding ? "holds something" : "empty"}`);
      say(values.Bumper, robot.touching ? "touches something" : "free");
      values.Bumper.classList.toggle("rosworld-bad", robot.touching);
    },
  };
}

/** A button for each thing that can fail and each way in which it does; the first state is sound. */
function faultButtons(possible, act) {
  let faults = {};
  const ways = Object.entries(possible).flatMap(
    ([what, [sound, ...broken]]) => broken.map((how) => ({ what, how, sound })));
  const buttons = ways.map(({ what, how, sound }) => make("button", {
    type: "button", "aria-pressed": "false",
    onclick: () => act({ fault: [what, faults[what] === how ? sound : how] }),
  }, `${what} ${how}`));
  return {
    element: make("div", { class: "rosworld-faults", role: "group", "aria-label": "Faults" },
      make("p", { class: "rosworld-head" }, "Break something"), ...buttons),
    draw(frame) {
      faults = frame.faults;
      ways.forEach(({ what, how }, place) => press(buttons[place], faults[what] === how));
    },
  };
}

/** A row for each topic; its button shows, and hides, what the topic carries. */
function topicTable(act) {
  const body = make("tbody", {});
  const rows = new Map();
  let chosen = "", known = "";
  const choose = (name) => {
    chosen = chosen === name ? "" : name;
    act({ topic: chosen });
  };
  const rowOf = (name) => {
    const button = make("button", { type: "button", "aria-expanded": "false", onclick: () => choose(name) }, name);
    const [type, rate, last] = [make("td", {}), make("td", {}), make("pre", {})];
    const below = make("tr", { hidden: true }, make("td", { colspan: 3 }, last));
    return { button, type, rate, last, below, row: make("tr", {}, make("td", {}, button), type, rate) };
  };
  return {
    element: make("table", { class: "rostable rosworld-topics" },
      make("thead", {}, make("tr", {},
        ...["topic", "type", "rate"].map((name) => make("th", { scope: "col" }, name)))), body),
    draw(topics) {
      const names = topics.map(({ name }) => name).join("\n");
      for (const { name, type, rate, last } of topics) {
        if (!rows.has(name)) rows.set(name, rowOf(name));
        const row = rows.get(name);
        say(row.type, type);
        say(row.rate, rate ? `${rate.toFixed(1)} Hz` : "now and then");
        say(row.last, last || "Nothing yet.");
        row.button.setAttribute("aria-expanded", String(name === chosen));
        row.below.hidden = name !== chosen;
      }
      if (names === known) return;
      known = names;
      body.replaceChildren(...topics.flatMap(({ name }) => [rows.get(name).row, rows.get(name).below]));
    },
  };
}

function mark(kind, text) {
  return make("span", {}, make("i", { class: `rosworld-mark rosworld-c-${kind}` }), text);
}

function press(button, down) {
  button.setAttribute("aria-pressed", String(down));
}

/** Change a text only if it is another: what somebody marks or hears is left alone. */
function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export default { render };
