// Draws a world from above: a layer that seldom changes (floor, shelves, stations), and on it what
// moves. Lengths are in metres, y grows upwards, and the floor fills the canvas' width.

const COLOURS = [
  "floor", "grid", "wall", "shelf", "shelfedge", "pad", "label", "beam", "trail", "path", "found",
  "obstacle", "stripe", "person", "skin", "robot", "rim", "wheel", "nose", "good", "bad", "ink",
];
const PARCELS = ["#d08c60", "#7fb069", "#5b8db8", "#e3b23c", "#b5739d", "#8d99ae"];
const MARGIN_M = 0.12;
const MAX_REACH_M = 8; // drawn of a beam that met nothing, unless the floor says more

/** Return {draw(frame, marks), toWorld(event), element} for a canvas that fits `frame.floor`. */
function floorPainter(floor) {
  const canvas = make("canvas", { class: "rosworld-canvas" });
  const probes = COLOURS.map((name) => make("i", { class: `rosworld-c-${name}` }));
  const palette = make("span", { hidden: true }, ...probes);
  const element = make("div", { class: "rosworld-floor" }, canvas, palette);
  const context = canvas.getContext("2d");
  const still = document.createElement("canvas");
  const facing = new Map(); // where people went between the last two frames
  let colours = {}, scale = 1, ratio = 1, last = null, known = "";
  let scan = { beams: "", from: null }; // the newest scan, and where the robot was when it came

  /** Take size and theme as they are now; redo the still layer if either has changed. */
  const fit = () => {
    const width = element.clientWidth;
    if (!width) return false;
    ratio = window.devicePixelRatio || 1;
    const read = probes.map((probe) => getComputedStyle(probe).color);
    const state = [width, ratio, ...read].join();
    if (state === known) return true;
    known = state;
    colours = Object.fromEntries(COLOURS.map((name, place) => [name, read[place]]));
    scale = width / (floor.width + 2 * MARGIN_M);
    const height = Math.round(scale * (floor.height + 2 * MARGIN_M));
    for (const layer of [canvas, still]) {
      layer.width = Math.round(width * ratio);
      layer.height = Math.round(height * ratio);
    }
    canvas.style.height = `${height}px`;
    const pen = still.getContext("2d");
    inMetres(pen);
    drawFloor(pen, floor, colours, scale);
    return true;
  };
  const inMetres = (pen) => {
    const unit = scale * ratio;
    pen.setTransform(unit, 0, 0, -unit, MARGIN_M * unit, (floor.height + MARGIN_M) * unit);
  };
  const draw = (frame, marks) => {
    last = [frame, marks];
    if (!fit()) return;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(still, 0, 0);
    inMetres(context);
    const beams = String(frame.beams);
    if (beams !== scan.beams) scan = { beams, from: frame.robot };
    drawBeams(context, frame.beams, scan.from, floor, colours);
    drawLines(context, frame, colours);
    for (const row of frame.obstacles) drawObstacle(context, row, colours, row[0] === marks.chosen);
    frame.people.forEach((person, number) => drawPerson(context, person, colours, turned(facing, number, person)));
    for (const [x, y] of frame.found) drawFound(context, x, y, colours);
    drawRobot(context, frame.robot, floor.robot_radius, colours);
  };
  const again = () => last && draw(...last);
  const sizes = new ResizeObserver(again);
  sizes.observe(element);
  const themes = new MutationObserver(again);
  themes.observe(document.body, { attributes: true });
  return {
    element, canvas, draw, again,
    /** Where the pointer is, in m. */
    toWorld(event) {
      const box = canvas.getBoundingClientRect();
      const metres = box.width / (floor.width + 2 * MARGIN_M);
      return [
        (event.clientX - box.left) / metres - MARGIN_M,
        floor.height + MARGIN_M - (event.clientY - box.top) / metres,
      ];
    },
    stop() {
      sizes.disconnect();
      themes.disconnect();
    },
  };
}

function drawFloor(pen, floor, colours, scale) {
  pen.fillStyle = colours.floor;
  pen.fillRect(-MARGIN_M, -MARGIN_M, floor.width + 2 * MARGIN_M, floor.height + 2 * MARGIN_M);
  pen.strokeStyle = colours.grid;
  pen.lineWidth = 1 / scale;
  pen.beginPath();
  for (let x = 0; x <= floor.width; x += 1) line(pen, x, 0, x, floor.height);
  for (let y = 0; y <= floor.height; y += 1) line(pen, 0, y, floor.width, y);
  pen.stroke();
  for (const station of floor.stations) drawPad(pen, station, colours);
  floor.shelves.forEach((shelf, number) => drawShelf(pen, shelf, number, colours));
  pen.strokeStyle = colours.wall;
  pen.lineWidth = 0.1;
  pen.lineCap = "round";
  pen.beginPath();
  for (const wall of floor.walls) line(pen, ...wall);
  pen.stroke();
  drawAxes(pen, colours, scale);
  for (const station of floor.stations) {
    write(pen, station.name, station.x, station.y - 0.62, colours.label, scale, 12);
  }
}

/** A pad on the floor: a filled disc in a dashed ring. */
function drawPad(pen, station, colours) {
  disc(pen, station.x, station.y, 0.3, colours.pad);
  pen.strokeStyle = colours.label;
  pen.lineWidth = 0.04;
  pen.setLineDash([0.12, 0.08]);
  ring(pen, station.x, station.y, 0.38);
  pen.setLineDash([]);
}

/** A shelf with parcels on it, always the same ones. */
function drawShelf(pen, [x, y, width, height], number, colours) {
  pen.fillStyle = colours.shelf;
  pen.fillRect(x, y, width, height);
  const along = width >= height;
  const [length, depth] = along ? [width, height] : [height, width];
  const slots = Math.max(1, Math.round(length / 0.42));
  const rows = Math.max(1, Math.round(depth / 0.5));
  for (let slot = 0; slot < slots; slot += 1) {
    for (let row = 0; row < rows; row += 1) {
      const dice = (number * 31 + slot * 17 + row * 7 + slot * slot * 3) % 11;
      if (dice > 8) continue; // an empty place
      const [long, deep] = [length / slots, depth / rows];
      const [u, v] = [slot * long + 0.06, row * deep + 0.06];
      const [w, h] = [long * (0.6 + dice * 0.02) - 0.02, deep - 0.12];
      const box = along ? [x + u, y + v, w, h] : [x + v, y + u, h, w];
      pen.fillStyle = PARCELS[dice % PARCELS.length];
      pen.fillRect(...box);
      pen.fillStyle = "rgba(255, 255, 255, 0.35)"; // its tape
      if (along) pen.fillRect(box[0] + box[2] * 0.42, box[1], box[2] * 0.16, box[3]);
      else pen.fillRect(box[0], box[1] + box[3] * 0.42, box[2], box[3] * 0.16);
    }
  }
  pen.strokeStyle = colours.shelfedge;
  pen.lineWidth = 0.05;
  pen.strokeRect(x, y, width, height);
}

/** The axes of REP 103, each 1 m long: they are the scale, too. */
function drawAxes(pen, colours, scale) {
  for (const [dx, dy, colour, name] of [[1, 0, colours.bad, "x, 1 m"], [0, 1, colours.good, "y"]]) {
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 0.04;
    pen.beginPath();
    line(pen, 0.2, 0.2, 0.2 + dx, 0.2 + dy);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(0.2 + dx * 1.12, 0.2 + dy * 1.12);
    pen.lineTo(0.2 + dx * 0.95 + dy * 0.07, 0.2 + dy * 0.95 + dx * 0.07);
    pen.lineTo(0.2 + dx * 0.95 - dy * 0.07, 0.2 + dy * 0.95 - dx * 0.07);
    pen.fill();
    const off = 11 / scale; // beside the arrow's tip, whatever the size
    write(pen, name, 0.2 + dx + dy * off, 0.2 + dy + dx * off, colour, scale, 11);
  }
}
