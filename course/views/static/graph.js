// Draws the ROS graph: boxes at the places that the kernel has worked out, arrows between them, and
// what QoS each end has. On a narrow page the drawing flows downwards, and shrinks as far as it can
// be read; what is wider still scrolls.

const LINE = 13; // px from one line of a label to the next
const READABLE = 0.85; // scale to which a drawing is shrunk before the other one is taken
const LEAST_SCALE = 0.6; // and below which it scrolls

const view = {
  label: "ROS graph",
  start(stage) {
    const arrows = newId(); // its own: an arrow would be drawn by the marker of another view
    return {
      draw(frame) {
        const drawing = fitting([frame, frame.tall ?? frame], stage.clientWidth);
        const svg = shape("svg", {
          class: "rosgraph", role: "img", "aria-label": frame.title,
          viewBox: `${drawing.left} 0 ${drawing.width} ${drawing.height}`,
          style: `width: ${drawing.width}px; min-width: ${Math.round(drawing.width * LEAST_SCALE)}px`,
        });
        svg.append(shape("defs", {}, marker(arrows, "good"), marker(arrows, "bad")));
        for (const line of drawing.lines) svg.append(arrow(line, arrows));
        for (const box of drawing.boxes) svg.append(drawnBox(box));
        for (const line of drawing.lines) svg.append(...labels(line)); // nothing is drawn over them
        stage.replaceChildren(
          drawing.boxes.length ? svg
            : make("p", {}, frame.note || "No nodes yet: run one with course.run(…)."),
        );
      },
    };
  },
};

/** The first drawing that fits and can be read with ease, or else the narrowest. */
function fitting(drawings, room) {
  const narrowest = drawings.reduce((one, other) => (other.width < one.width ? other : one));
  return drawings.find((drawing) => drawing.width * READABLE <= room) ?? narrowest;
}

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
  return shape(
    "g", { class: `rosgraph-line rosgraph-${kind} rosgraph-${line.kind}` },
    shape("title", {}, line.tip),
    shape("path", { d: line.path, "marker-end": `url(#${arrows}-${kind})` }),
    shape("path", { d: line.path, class: "rosgraph-reach" }), // a line is too thin to point at
  );
}

function labels(line) {
  const lines = [...(line.qos ? [["qos", line.qos]] : []), ...line.reasons.map((text) => ["reason", text])];
  if (!lines.length) return [];
  const width = 6 * Math.max(...lines.map(([, text]) => text.length));
  const back = shape("rect", {
    class: "rosgraph-back", x: line.x - width / 2, y: line.y - LINE / 2, width, height: LINE * lines.length,
  });
  return [back, ...lines.map(([kind, text], number) => shape(
    "text",
    { x: line.x, y: line.y + LINE * number, dy: "0.35em",
      class: `rosgraph-${kind}${line.bad ? " rosgraph-bad" : ""}` },
    text,
  ))];
}

function drawnBox(box) {
  const group = shape(
    "g", { class: `rosgraph-box rosgraph-${box.kind}${box.bad ? " rosgraph-bad" : ""}` },
    shape("title", {}, box.tip),
    shape("path", { d: box.outline }),
    shape("text", { x: box.x + box.width / 2, y: box.y + (box.note ? 17 : 24) }, box.label),
  );
  if (box.note) {
    group.append(
      shape("text", { class: "rosgraph-note", x: box.x + box.width / 2, y: box.y + 31 }, box.note),
    );
  }
  return group;
}

export default { render };
