// Lanes of topics: a stroke where something happened, stronger where much did; gaps shaded, drops
// marked; rate and latency (median and 95th percentile) as lines below.

const WIDEST = 760; // px of the lanes; on a narrow page they are as wide as there is room
const NARROWEST = 160;
const CHARACTER = 7; // px of a label
const LANE = 20;
const PLOT = 40;
const SPACE = 12;

const view = {
  label: "Timeline",
  start(stage) {
    return {
      draw(frame) {
        const size = sizes(stage.clientWidth);
        stage.replaceChildren(...frame.topics.map((topic) => block(topic, frame, size)));
      },
    };
  },
};

/** How wide labels and lanes are in so many px: "now", at the end of the lanes, is always in sight. */
function sizes(room) {
  const label = room < 640 ? 110 : 170;
  return { LABEL: label, WIDTH: Math.max(NARROWEST, Math.min(WIDEST, room - label - 10)) };
}

function block(topic, frame, size) {
  const { LABEL, WIDTH } = size;
  const lanes = topic.lanes.length;
  const height = lanes * LANE + 2 * (PLOT + SPACE) + 22;
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
    }, shape("title", {}, `gap of ${((to - from) * frame.window).toFixed(2)} s`)));
  }
  topic.lanes.forEach((lane, row) => {
    const y = row * LANE;
    const most = Math.max(1, ...lane.counts);
    svg.append(shape("text", { x: LABEL - 8, y: y + 14, class: "rostimeline-label" },
      shortened(lane.label, LABEL), shape("title", {}, lane.label)));
    svg.append(shape("line", { x1: LABEL, x2: LABEL + WIDTH, y1: y + LANE - 2, y2: y + LANE - 2 }));
    let path = "";
    lane.counts.forEach((count, place) => {
      if (count) {
        const x = LABEL + (place + 0.5) * column;
        path += `M${x.toFixed(1)},${y + LANE - 2} v${(-(0.35 + 0.65 * count / most) * (LANE - 5)).toFixed(1)} `;
      }
    });
    svg.append(shape("path", { class: `rostimeline-lane${Math.min(row, 2)}`, d: path }));
    const what = row < 2 ? "lost on the way" : "passed this callback by";
    for (const [place, count] of lane.drops) {
      const x = (LABEL + Math.max(0, Math.min(1, place)) * WIDTH).toFixed(1);
      svg.append(shape("path", { class: "rostimeline-drop", d: `M${x},${y} m-4,0 h8 l-4,7 Z` },
        shape("title", {}, `${count} ${what}`)));
    }
  });
  svg.append(
    ...plot("rate", "Hz", 1, [["rostimeline-rate", topic.rate]], lanes * LANE + SPACE, size),
    ...plot("latency p50, p95", "ms", 2, [["rostimeline-p50", topic.p50], ["rostimeline-p95", topic.p95]],
      lanes * LANE + 2 * SPACE + PLOT, size),
  );
  const base = height - 4;
  svg.append(
    shape("text", { x: LABEL, y: base }, `${-frame.window} s`),
    shape("text", { x: LABEL + WIDTH, y: base, class: "rostimeline-label rostimeline-now" }, "now"),
  );
  return make("div", {}, make("p", { class: "rostimeline-title" },
    make("strong", {}, topic.name), ` ${topic.text}`,
    ...(topic.newest ? [make("br"), "newest message: ", make("b", { class: "rostimeline-newest" }, topic.newest)] : [])),
  svg);
}

/** A label that fits its place: the end of a name tells more than its beginning. */
function shortened(label, room) {
  const most = Math.floor(room / CHARACTER);
  return label.length <= most ? label : `…${label.slice(1 - most)}`;
}

/** Lines over one axis from 0 to the largest value; a part of the window without a value is skipped. */
function plot(name, unit, digits, lines, top, { LABEL, WIDTH }) {
  const values = lines.flatMap(([, line]) => line.filter((value) => value !== null));
  const most = Math.max(10 ** -digits, ...values);
  const drawn = lines.map(([style, line]) => {
    const step = WIDTH / line.length;
    const points = line
      .map((value, place) => value === null ? null
        : `${(LABEL + (place + 0.5) * step).toFixed(1)},${(top + PLOT - value / most * (PLOT - 4)).toFixed(1)}`)
      .filter(Boolean);
    return shape("polyline", { class: style, points: points.join(" ") });
  });
  return [
    shape("text", { x: LABEL - 8, y: top + 12, class: "rostimeline-label" }, name),
    shape("text", { x: LABEL - 8, y: top + 26, class: "rostimeline-label" },
      values.length ? `up to ${most.toFixed(digits)} ${unit}` : "nothing yet"),
    shape("line", { x1: LABEL, x2: LABEL + WIDTH, y1: top + PLOT, y2: top + PLOT }),
    ...drawn,
  ];
}

export default { render };
