// Lanes of topics: a stroke where something happened, stronger where much did; gaps hatched; the
// largest latency of each column as a line below.

const WIDTH = 760;
const LABEL = 170;
const LANE = 20;
const PLOT = 44;

const view = {
  label: "Timeline",
  start(stage) {
    return {
      draw(frame) {
        stage.replaceChildren(...frame.topics.map((topic) => block(topic, frame)));
      },
    };
  },
};

function block(topic, frame) {
  const lanes = topic.lanes.length;
  const height = lanes * LANE + PLOT + 26;
  const svg = shape("svg", {
    class: "rostimeline", role: "img", "aria-label": `${topic.name}: ${topic.text}`,
    viewBox: `0 0 ${LABEL + WIDTH + 10} ${height}`, width: LABEL + WIDTH + 10, height,
  });
  const column = WIDTH / frame.columns;
  for (const [from, to] of topic.gaps) {
    const x = LABEL + Math.max(0, from) * WIDTH;
    svg.append(shape("rect", {
      class: "rostimeline-gap", x, y: 0,
      width: Math.max(1, LABEL + Math.min(1, to) * WIDTH - x), height: lanes * LANE,
    }));
  }
  topic.lanes.forEach((lane, row) => {
    const y = row * LANE;
    const most = Math.max(1, ...lane.counts);
    svg.append(shape("text", { x: LABEL - 8, y: y + 14, class: "rostimeline-label" }, lane.label));
    svg.append(shape("line", { x1: LABEL, x2: LABEL + WIDTH, y1: y + LANE - 2, y2: y + LANE - 2 }));
    let path = "";
    lane.counts.forEach((count, place) => {
      if (count) {
        const x = LABEL + (place + 0.5) * column;
        path += `M${x.toFixed(1)},${y + LANE - 2} v${(-(0.35 + 0.65 * count / most) * (LANE - 5)).toFixed(1)} `;
      }
    });
    svg.append(shape("path", { class: `rostimeline-lane${Math.min(row, 2)}`, d: path }));
  });
  svg.append(...latency(topic.latency, lanes * LANE + 10, column));
  const base = height - 4;
  svg.append(
    shape("text", { x: LABEL, y: base }, `${-frame.window} s`),
    shape("text", { x: LABEL + WIDTH, y: base, class: "rostimeline-label" }, "now"),
  );
  return make("div", {}, make("p", { class: "rostimeline-title" },
    make("strong", {}, topic.name), ` ${topic.text}`), svg);
}

function latency(values, top, column) {
  const most = Math.max(0.1, ...values.map((value) => value ?? 0));
  const points = values
    .map((value, place) => value === null ? null
      : `${(LABEL + (place + 0.5) * column).toFixed(1)},${(top + PLOT - value / most * (PLOT - 6)).toFixed(1)}`)
    .filter(Boolean);
  return [
    shape("text", { x: LABEL - 8, y: top + 12, class: "rostimeline-label" }, `latency, ${most.toFixed(1)} ms`),
    shape("line", { x1: LABEL, x2: LABEL + WIDTH, y1: top + PLOT, y2: top + PLOT }),
    shape("polyline", { class: "rostimeline-latency", points: points.join(" ") }),
  ];
}

export default { render };
