// Draws the ROS graph: boxes at the places that the kernel has worked out, arrows between them.

const view = {
  label: "ROS graph",
  start(stage) {
    const arrows = newId(); // its own: an arrow would be drawn by the marker of another view
    return {
      draw(frame) {
        const svg = shape("svg", {
          class: "rosgraph", role: "img", "aria-label": frame.title,
          viewBox: `0 0 ${frame.width} ${frame.height}`,
          width: frame.width, height: frame.height,
        });
        svg.append(shape("defs", {}, marker(arrows, "good"), marker(arrows, "bad")));
        for (const line of frame.lines) svg.append(arrow(line, arrows));
        for (const box of frame.boxes) svg.append(drawnBox(box));
        stage.replaceChildren(
          frame.boxes.length ? svg
            : make("p", {}, frame.note || "No nodes yet: run one with course.run(…)."),
        );
      },
    };
  },
};

function marker(arrows, kind) {
  return shape(
    "marker",
    { id: `${arrows}-${kind}`, viewBox: "0 0 8 8", refX: 8, refY: 4, markerWidth: 8, markerHeight: 8,
      orient: "auto-start-reverse", class: `rosgraph-${kind}` },
    shape("path", { d: kind === "bad" ? "M1,1 L7,7 M7,1 L1,7" : "M0,0 L8,4 L0,8 Z" }),
  );
}

function arrow(line, arrows) {
  const kind = line.bad ? "bad" : "good";
  const group = shape(
    "g", { class: `rosgraph-line rosgraph-${kind} rosgraph-${line.kind}` },
    shape("title", {}, line.tip),
    shape("path", { d: line.path, "marker-end": `url(#${arrows}-${kind})` }),
    shape("path", { d: line.path, class: "rosgraph-reach" }), // a line is too thin to point at
  );
  if (line.label) {
    group.append(shape("text", { x: line.x, y: line.y }, line.label));
  }
  return group;
}

function drawnBox(box) {
  const group = shape(
    "g", { class: `rosgraph-box rosgraph-${box.kind}${box.bad ? " rosgraph-bad" : ""}` },
    shape("title", {}, box.tip),
    shape("rect", {
      x: box.x, y: box.y, width: box.width, height: box.height,
      rx: box.kind === "node" ? box.height / 2 : 3,
    }),
    shape("text", { x: box.x + box.width / 2, y: box.y + (box.note ? 17 : 23) }, box.label),
  );
  if (box.note) {
    group.append(
      shape("text", { class: "rosgraph-note", x: box.x + box.width / 2, y: box.y + 31 }, box.note),
    );
  }
  return group;
}

export default { render };
