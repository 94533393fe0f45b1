// Laser fans, cast against the walls that stand: each in its robot's colour, many as one area of light.

const LIT_TOGETHER = 12;   // robots: beyond, all fans are one area
const BEAMS_TOGETHER = 72; // of each of them

class Fans {
  constructor(run, terrain) {
    Object.assign(this, { run, terrain });
  }

  draw(context, camera, view) {
    const { lasers } = this.run.about, count = this.run.robots.length, { theme, chosen } = view;
    if (!lasers || (chosen < 0 && this.run.isLarge)) return;
    const together = chosen < 0 && count > LIT_TOGETHER;
    if (together) context.beginPath();
    for (let robot = 0; robot < count; robot++) {
      if ((chosen >= 0 && robot !== chosen) || !view.up.robots[robot]) continue;
      const reach = Math.max(...lasers[robot].map((laser) => laser.range_m)) * camera.scale;
      const sx = camera.sx(view.poses[3 * robot]), sy = camera.sy(view.poses[3 * robot + 1]);
      if (sx < -reach || sy < -reach || sx > camera.width + reach || sy > camera.height + reach) {
        continue;
      }
      if (!together) context.beginPath();
      for (const laser of lasers[robot]) {
        this.#fan(context, camera, view, robot, laser,
          together ? Math.min(laser.beams, BEAMS_TOGETHER) : laser.beams);
      }
      if (!together) fillFan(context, robotColour(theme, robot), theme, robot === chosen);
    }
    if (!together) return;
    context.fillStyle = theme.lit;
    context.fill();
  }

  #fan(path, camera, { poses, timeS }, robot, laser, beams) {
    const rays = this.terrain.raysAt(timeS, laser.height_m);
    const { field_of_view_rad: field, range_m: reach, mount: [ahead, left, turned] } = laser;
    const yaw = poses[3 * robot + 2], c = Math.cos(yaw), s = Math.sin(yaw);
    const x = poses[3 * robot] + c * ahead - s * left;
    const y = poses[3 * robot + 1] + s * ahead + c * left;
    path.moveTo(camera.sx(x), camera.sy(y));
    for (let beam = 0; beam < beams; beam++) {
      const angle = yaw + turned + field * (beam / (beams - 1) - 0.5);
      const ux = Math.cos(angle), uy = Math.sin(angle), range = rays.cast(x, y, ux, uy, reach);
      path.lineTo(camera.sx(x + ux * range), camera.sy(y + uy * range));
    }
    path.closePath();
  }
}

// Fill the path that a fan is; the selected robot's has a rim.
function fillFan(context, colour, theme, chosen) {
  context.fillStyle = alpha(colour, chosen ? 0.2 : theme.fan);
  context.fill();
  if (!chosen) return;
  context.strokeStyle = alpha(colour, 0.5);
  context.lineWidth = 0.75;
  context.stroke();
}
