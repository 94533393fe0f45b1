// Robots: discs or polygons of their size with their noses in front; people and carts: discs of the walls' colour.

const LEAST_RADIUS_PX = 4;

class Robots {
  constructor(run, style) {
    Object.assign(this, { run, style });
    this.crowd = Array.from({ length: HUES }, () => []);  // robots that are drawn at once, by colour
  }

  draw(context, camera, view) {
    const { chosen } = view, count = this.run.robots.length, together = this.run.isLarge && !this.style.hollow;
    for (const list of this.crowd) list.length = 0;
    context.save();
    for (let robot = 0; robot < count; robot++) {
      if (robot === chosen) continue;
      const sx = camera.sx(view.poses[3 * robot]), sy = camera.sy(view.poses[3 * robot + 1]);
      if (sx < -20 || sy < -20 || sx > camera.width + 20 || sy > camera.height + 20) continue;
      if (together && view.up.robots[robot]) this.crowd[robot % HUES].push(robot);
      else this.#one(context, camera, view, robot);
    }
    if (together) this.#crowd(context, camera, view);
    if (chosen >= 0) this.#one(context, camera, view, chosen);  // over all others
    context.restore();
  }

  #one(context, camera, view, robot) {
    context.globalAlpha = view.chosen >= 0 && robot !== view.chosen ? 0.55 : 1;
    drawRobot(context, camera.sx(view.poses[3 * robot]), camera.sy(view.poses[3 * robot + 1]),
      view.poses[3 * robot + 2], robotRadius(this.run, camera, robot), {
        corners: this.run.cornersOf(robot), colour: robotColour(view.theme, robot), theme: view.theme, hollow: this.style.hollow,
        up: view.up.robots[robot], chosen: robot === view.chosen });
  }

  // Many robots: those of one colour at once.
  #crowd(context, camera, view) {
    context.globalAlpha = view.chosen >= 0 ? 0.55 : 1;
    context.strokeStyle = view.theme.halo;
    context.lineWidth = 2;
    this.crowd.forEach((list, hue) => {
      context.beginPath();
      for (const robot of list) {
        robotOutline(context, camera.sx(view.poses[3 * robot]), camera.sy(view.poses[3 * robot + 1]),
          view.poses[3 * robot + 2], robotRadius(this.run, camera, robot),
          this.run.cornersOf(robot));
      }
      context.stroke();
      context.fillStyle = view.theme.hues[hue];
      context.fill();
    });
  }
}

class Obstacles {
  constructor(run) {
    this.run = run;
  }

  draw(context, camera, view) {
    context.save();
    context.fillStyle = view.theme.wall;
    context.strokeStyle = view.theme.halo;
    context.lineWidth = 1.5;
    for (const [x, y, radius] of this.run.obstaclesAt(view.timeS)) {
      context.beginPath();
      circle(context, camera.sx(x), camera.sy(y), Math.max(3, radius * camera.scale));
      context.stroke();
      context.fill();
    }
    context.restore();
  }
}

// In pixels.
function robotRadius(run, camera, robot) {
  return Math.max(LEAST_RADIUS_PX, run.about.radius_m[robot] * camera.scale);
}

// A ghost is hollow, a robot whose host is down is crossed out, the selected one has a wide rim.
function drawRobot(context, x, y, yaw, radius, { corners, colour, theme, hollow, chosen, up }) {
  context.beginPath();
  robotOutline(context, x, y, yaw, radius, corners);
  if (chosen) {
    context.strokeStyle = alpha(theme.accent, 0.4);
    context.lineWidth = 10;
    context.stroke();
  }
  if (hollow || !up) {
    context.fillStyle = alpha(theme.halo, hollow ? 0.3 : 0.8);
    context.fill();
    context.strokeStyle = colour;
    context.lineWidth = 1.5;
    context.stroke();
  } else {
    context.strokeStyle = theme.halo;
    context.lineWidth = radius < 5 ? 1.6 : 2.4;
    context.stroke();
    context.fillStyle = colour;
    context.fill();
  }
  if (up) return;
  context.strokeStyle = theme.alarm;
  context.lineWidth = 2;
  context.beginPath();
  cross(context, x, y, radius * 1.3);
  context.stroke();
}
