// Draws what is on a world's floor: beams, trail and path, obstacles, people, the robot. Lengths in m.

/** Beams start where their scan was taken: the robot may have turned meanwhile. */
function drawBeams(pen, beams, from, floor, colours) {
  const most = floor.lidar_range ?? MAX_REACH_M;
  const ends = beams.map((beam, place) => {
    const angle = from.yaw + 2 * Math.PI * place / beams.length;
    const reach = beam === null ? most : beam / 100;
    return [from.x + reach * Math.cos(angle), from.y + reach * Math.sin(angle), beam !== null];
  });
  if (!ends.length) return;
  pen.save();
  pen.beginPath();
  pen.rect(0, 0, floor.width, floor.height);
  pen.clip();
  const glow = pen.createRadialGradient(from.x, from.y, 0.1, from.x, from.y, most);
  glow.addColorStop(0, colours.beam);
  glow.addColorStop(1, colours.beam.replace("rgb(", "rgba(").replace(")", ", 0.15)"));
  pen.fillStyle = glow;
  pen.globalAlpha = 0.32;
  pen.beginPath();
  for (const [x, y] of ends) pen.lineTo(x, y);
  pen.fill();
  pen.strokeStyle = colours.beam;
  pen.globalAlpha = 0.16;
  pen.lineWidth = 0.015;
  pen.beginPath();
  for (const [x, y] of ends) line(pen, from.x, from.y, x, y);
  pen.stroke();
  pen.restore();
  for (const [x, y, met] of ends) if (met) disc(pen, x, y, 0.045, colours.beam);
}

function drawLines(pen, frame, colours) {
  const { trail, path } = frame;
  pen.lineJoin = "round";
  pen.lineCap = "butt"; // round ends of two parts would lie on each other
  pen.strokeStyle = colours.trail;
  pen.lineWidth = 0.07;
  const parts = 6; // the older, the fainter
  for (let part = 0; part < parts; part += 1) {
    const from = Math.floor(trail.length * part / parts);
    const to = Math.floor(trail.length * (part + 1) / parts);
    pen.globalAlpha = 0.3 + 0.12 * part;
    along(pen, trail.slice(from, to + 1));
  }
  pen.globalAlpha = 1;
  pen.lineCap = "round";
  if (!path.length) return;
  pen.strokeStyle = colours.path;
  pen.lineWidth = 0.06;
  pen.setLineDash([0.18, 0.14]);
  along(pen, path);
  pen.setLineDash([]);
  const [x, y] = path[path.length - 1]; // a flag where it ends
  pen.beginPath();
  line(pen, x, y, x, y + 0.5);
  pen.stroke();
  pen.fillStyle = colours.path;
  pen.beginPath();
  pen.moveTo(x, y + 0.52);
  pen.lineTo(x + 0.34, y + 0.4);
  pen.lineTo(x, y + 0.27);
  pen.fill();
}

/** A traffic cone from above. */
function drawObstacle(pen, [, x, y, radius], colours, chosen) {
  disc(pen, x + 0.03, y - 0.04, radius * 1.02, "rgba(0, 0, 0, 0.22)");
  disc(pen, x, y, radius, colours.obstacle);
  disc(pen, x, y, radius * 0.68, colours.stripe);
  disc(pen, x, y, radius * 0.44, colours.obstacle);
  disc(pen, x, y, radius * 0.14, colours.stripe);
  if (!chosen) return;
  pen.strokeStyle = colours.ink;
  pen.lineWidth = 0.035;
  pen.setLineDash([0.1, 0.07]);
  ring(pen, x, y, radius + 0.1);
  pen.setLineDash([]);
}

/** Which way a person looks: where they have gone since the last frame. */
function turned(facing, number, [x, y]) {
  const was = facing.get(number) ?? { x, y, angle: -Math.PI / 2 };
  const moved = Math.hypot(x - was.x, y - was.y);
  const angle = moved > 0.01 ? Math.atan2(y - was.y, x - was.x) : was.angle;
  if (moved > 0.01 || !facing.has(number)) facing.set(number, { x, y, angle });
  return angle;
}

function drawPerson(pen, [x, y, radius], colours, angle) {
  pen.save();
  pen.translate(x, y);
  pen.rotate(angle);
  pen.fillStyle = "rgba(0, 0, 0, 0.2)";
  oval(pen, -0.02, -0.04, radius * 0.7, radius * 1.05);
  pen.fillStyle = colours.person;
  oval(pen, 0, 0, radius * 0.55, radius);
  disc(pen, radius * 0.3, radius * 0.75, radius * 0.22, colours.skin);
  disc(pen, radius * 0.3, -radius * 0.75, radius * 0.22, colours.skin);
  disc(pen, radius * 0.08, 0, radius * 0.42, colours.skin);
  disc(pen, -radius * 0.04, 0, radius * 0.4, colours.ink);
  pen.restore();
}

function drawFound(pen, x, y, colours) {
  pen.strokeStyle = colours.found;
  pen.lineWidth = 0.05;
  pen.setLineDash([0.1, 0.06]);
  ring(pen, x, y, 0.32);
  pen.setLineDash([]);
  pen.beginPath();
  line(pen, x - 0.1, y - 0.1, x + 0.1, y + 0.1);
  line(pen, x - 0.1, y + 0.1, x + 0.1, y - 0.1);
  pen.stroke();
}

function drawRobot(pen, robot, radius, colours) {
  pen.save();
  pen.translate(robot.x, robot.y);
  if (robot.touching || robot.stopped) {
    pen.strokeStyle = colours.bad;
    pen.lineWidth = 0.06;
    if (robot.touching) pen.setLineDash([0.1, 0.08]);
    ring(pen, 0, 0, radius * 1.35);
    pen.setLineDash([]);
  }
  disc(pen, 0.04, -0.05, radius * 1.03, "rgba(0, 0, 0, 0.28)");
  pen.rotate(robot.yaw);
  pen.fillStyle = colours.wheel;
  for (const side of [-1, 1]) slab(pen, -radius * 0.35, side * radius * 0.98 - 0.05, radius * 0.7, 0.1);
  drawGripper(pen, robot, radius, colours);
  disc(pen, 0, 0, radius * 1.12, colours.rim);
  disc(pen, 0, 0, radius, colours.robot);
  pen.fillStyle = colours.nose;
  pen.beginPath();
  pen.moveTo(radius * 0.86, 0);
  pen.lineTo(radius * 0.28, radius * 0.52);
  pen.lineTo(radius * 0.28, -radius * 0.52);
  pen.fill();
  disc(pen, -radius * 0.12, 0, radius * 0.4, colours.wheel); // the LIDAR
  disc(pen, -radius * 0.12, 0, radius * 0.24, colours.beam);
  disc(pen, -radius * 0.7, 0, radius * 0.14, robot.stopped ? colours.bad : colours.good);
  pen.restore();
}

function drawGripper(pen, robot, radius, colours) {
  const wide = radius * (robot.gripper === "open" ? 0.55 : robot.holding ? 0.42 : 0.16);
  if (robot.holding) {
    pen.fillStyle = PARCELS[0];
    slab(pen, radius * 0.95, -radius * 0.36, radius * 0.72, radius * 0.72);
  }
  pen.fillStyle = colours.wheel;
  for (const side of [-1, 1]) slab(pen, radius * 0.8, side * wide - 0.03, radius * 0.85, 0.06);
}

function line(pen, x1, y1, x2, y2) {
  pen.moveTo(x1, y1);
  pen.lineTo(x2, y2);
}

function along(pen, points) {
  pen.beginPath();
  for (const [x, y] of points) pen.lineTo(x, y);
  pen.stroke();
}

function disc(pen, x, y, radius, colour) {
  pen.fillStyle = colour;
  oval(pen, x, y, radius, radius);
}

function oval(pen, x, y, long, wide) {
  pen.beginPath();
  pen.ellipse(x, y, long, wide, 0, 0, 2 * Math.PI);
  pen.fill();
}

function ring(pen, x, y, radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.stroke();
}

function slab(pen, x, y, width, height) {
  pen.beginPath();
  pen.roundRect(x, y, width, height, Math.min(width, height) * 0.3);
  pen.fill();
}

/** Text that stands upright at a place in m; its size is in px of the page. */
function write(pen, text, x, y, colour, scale, size) {
  pen.save();
  pen.translate(x, y);
  pen.scale(1 / scale, -1 / scale);
  pen.fillStyle = colour;
  pen.font = `600 ${size}px ${getComputedStyle(document.body).fontFamily || "sans-serif"}`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 0, 0);
  pen.restore();
}
