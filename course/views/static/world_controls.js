// A world's controls: its time, the emergency stop, the arrow keys, and the pointer on obstacles.

const SPEED = 0.5; // m/s that the arrow keys drive
const TURN = 1.2; // rad/s that they turn
const REPEAT_MS = 100; // between two commands while a key is held, and between two places of a drag
const NUDGE = 0.1; // m that Shift and an arrow move an obstacle
const REACH = 0.1; // m beside an obstacle that still count as on it
const PACES = [0.25, 0.5, 1, 2, 4];
const ARROWS = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] };

function toolbar(state, act) {
  const button = (text, message, more = {}) =>
    make("button", { type: "button", onclick: () => act(message()), ...more }, text);
  const pause = button("Pause", () => ({ do: state.frame.paused ? "resume" : "pause" }), { "aria-pressed": "false" });
  const step = button("Step 0.1 s", () => ({ do: "step_once" }));
  const pace = make("select", {
    "aria-label": "Speed of the world", onchange: () => act({ speed: Number(pace.value) }),
  }, ...PACES.map((factor) => make("option", { value: factor }, `${factor}×`)));
  const pressStop = () => act({ do: state.frame.robot.stopped ? "release_stop" : "press_stop" });
  const stop = make("button", {
    type: "button", class: "rosworld-stop", "aria-pressed": "false", onclick: pressStop,
  }, "Emergency stop");
  const time = make("span", { class: "rosworld-time" });
  return {
    pressStop,
    element: make("div", { class: "rosworld-bar", role: "group", "aria-label": "Controls of the world" },
      pause, step, pace, button("Reset", () => ({ do: "reset" })), time, stop),
    draw(frame) {
      press(pause, frame.paused);
      press(stop, frame.robot.stopped);
      if (document.activeElement !== pace) pace.value = String(frame.speed);
      say(time, `${frame.time.toFixed(frame.paused ? 2 : 1)} s${frame.paused ? ", paused" : ""}`);
    },
  };
}

/** Where an obstacle is chosen, added and removed without a pointer. */
function obstaclePicker(state, act, painter) {
  const select = make("select", {
    "aria-label": "Obstacle", onchange: () => { state.chosen = Number(select.value) || null; painter.again(); },
  });
  const add = () => {
    const { robot, floor } = state.frame;
    const inside = (value, most) => Math.min(most - 0.3, Math.max(0.3, value));
    act({ add: [
      inside(robot.x + Math.cos(robot.yaw), floor.width), inside(robot.y + Math.sin(robot.yaw), floor.height),
    ] });
  };
  const remove = () => state.chosen !== null && act({ remove: state.chosen });
  const removal = make("button", { type: "button", onclick: remove }, "Remove it");
  let known = null;
  return {
    remove,
    choose(id) {
      state.chosen = id;
      if (id !== null) select.value = String(id);
    },
    /** Move the chosen one a little. */
    nudge([dx, dy]) {
      const row = state.frame.obstacles.find(([id]) => id === state.chosen);
      if (row) act({ move: [row[0], row[1] + dx * NUDGE, row[2] + dy * NUDGE] });
    },
    element: make("div", { class: "rosworld-tools", role: "group", "aria-label": "Obstacles" },
      make("span", {}, "Obstacles "), select,
      removal, make("button", { type: "button", onclick: add }, "Add one in front")),
    draw(frame) {
      const ids = frame.obstacles.map(([id]) => id);
      if (String(ids) === known) return;
      const fresh = known === null ? null : ids.find((id) => !known.split(",").includes(String(id)));
      known = String(ids);
      select.replaceChildren(...ids.map((id) => make("option", { value: id }, `number ${id}`)));
      if (!ids.length) select.append(make("option", {}, "none"));
      removal.setAttribute("aria-disabled", String(!ids.length));
      this.choose(fresh ?? (ids.includes(state.chosen) ? state.chosen : ids[0] ?? null));
    },
  };
}

/** Drive while arrow keys are held; return what stops it. */
function driveByKeys(canvas, state, act, obstacles, bar) {
  const held = new Set();
  let timer = 0;
  const command = () => {
    const [turn, ahead] = [...held].map((key) => ARROWS[key])
      .reduce(([x, y], [dx, dy]) => [x + dx, y + dy], [0, 0]);
    act({ drive: [ahead * SPEED, -turn * TURN * (ahead < 0 ? -1 : 1)] });
  };
  const halt = () => {
    if (timer) {
      clearInterval(timer);
      timer = 0;
      held.clear();
      command();
    }
  };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const arrow = ARROWS[event.key];
    if (arrow && event.shiftKey) obstacles.nudge(arrow);
    else if (arrow && !held.has(event.key)) {
      held.add(event.key);
      command();
      timer ||= setInterval(command, REPEAT_MS);
    } else if (event.key === " " && !event.repeat) bar.pressStop();
    else if (event.key === "Delete") obstacles.remove();
    if (arrow || event.key === " ") event.preventDefault(); // the page stays where it is
  });
  canvas.addEventListener("keyup", (event) => {
    if (held.delete(event.key)) held.size ? command() : halt();
  });
  canvas.addEventListener("blur", halt);
  return halt;
}

function dragObstacles(painter, state, act, obstacles, pointer) {
  const { canvas } = painter;
  const under = ([x, y]) => state.frame.obstacles.find(
    ([, ox, oy, radius]) => Math.hypot(x - ox, y - oy) <= radius + REACH,
  );
  let sent = 0;
  canvas.addEventListener("pointerdown", (event) => {
    const row = under(painter.toWorld(event));
    if (!row || event.button) return;
    canvas.setPointerCapture(event.pointerId);
    obstacles.choose(row[0]);
    state.dragged = { id: row[0], x: row[1], y: row[2] };
    painter.again();
  });
  canvas.addEventListener("pointermove", (event) => {
    const [x, y] = painter.toWorld(event);
    pointer.textContent = `here: x ${x.toFixed(2)} m, y ${y.toFixed(2)} m`;
    canvas.style.cursor = state.dragged ? "grabbing" : under([x, y]) ? "grab" : "";
    if (!state.dragged) return;
    Object.assign(state.dragged, { x, y });
    if (event.timeStamp - sent < REPEAT_MS) return;
    sent = event.timeStamp;
    act({ move: [state.dragged.id, x, y] });
  });
  const drop = () => {
    if (state.dragged) act({ move: [state.dragged.id, state.dragged.x, state.dragged.y] });
    state.dragged = null;
  };
  canvas.addEventListener("pointerup", drop);
  canvas.addEventListener("pointercancel", drop);
  canvas.addEventListener("pointerleave", () => { pointer.textContent = ""; });
  canvas.addEventListener("dblclick", (event) => {
    const place = painter.toWorld(event);
    if (!under(place)) act({ add: place });
  });
}
