// Sonars and bumpers: in the cone of each transducer the nearest wall, as an arc; a ring around a
// robot that has just touched something.

const PRESSED_S = 1;  // so long a contact is shown

class NearBy {
  constructor(run, terrain) {
    Object.assign(this, { run, terrain });
  }

  draw(context, camera, view) {
    const { sonars } = this.run.about, { chosen, theme } = view, count = this.run.robots.length;
    context.save();
    for (let robot = 0; robot < count; robot++) {
      if (chosen >= 0 ? robot !== chosen : count > LIT_TOGETHER) continue;
      if (!sonars?.[robot] || !view.up.robots[robot]) continue;
      const colour = robotColour(theme, robot);
      for (const [x, y, angle, range] of this.readings(view.timeS, view.poses, robot)) {
        const { cone_rad: cone, range_m: reach } = sonars[robot];
        sonarCone(context, camera.sx(x), camera.sy(y), angle, cone, range * camera.scale,
          alpha(colour, 0.16), range < reach ? colour : null);
      }
    }
    this.#bumps(context, camera, view);
    context.restore();
  }

  // Of each transducer of a robot: x [m], y [m], angle [rad], reading [m].
  readings(timeS, poses, robot) {
    const { rays, cone_rad: cone, least_m: least, range_m: reach, mounts, height_m: height } =
      this.run.about.sonars[robot];
    const walls = this.terrain.raysAt(timeS, height), yaw = poses[3 * robot + 2];
    const c = Math.cos(yaw), s = Math.sin(yaw);
    return mounts.map(([ahead, left, turned]) => {
      const x = poses[3 * robot] + c * ahead - s * left;
      const y = poses[3 * robot + 1] + s * ahead + c * left;
      let nearest = reach;
      for (let ray = 0; ray < rays; ray++) {
        const angle = yaw + turned + cone * (ray / (rays - 1) - 0.5);
        nearest = walls.cast(x, y, Math.cos(angle), Math.sin(angle), nearest);
      }
      return [x, y, yaw + turned, Math.max(nearest, least)];
    });
  }

  // How long ago [s] each bumper was pressed, of those that were pressed just now: robot and time.
  pressed(timeS) {
    const { ns, robot } = this.run.bump.at, found = new Map();
    for (let k = countUpTo(ns, Math.round(timeS * NS), this.run.bump.length) - 1; k >= 0; k--) {
      const agoS = timeS - ns[k] / NS;
      if (agoS > PRESSED_S) break;
      if (!found.has(robot[k])) found.set(robot[k], agoS);
    }
    return found;
  }

  #bumps(context, camera, view) {
    for (const [robot, agoS] of this.pressed(view.timeS)) {
      context.globalAlpha = 1 - agoS / PRESSED_S;
      bumperRing(context, camera.sx(view.poses[3 * robot]), camera.sy(view.poses[3 * robot + 1]),
        robotRadius(this.run, camera, robot), view.theme);
    }
  }
}

// A cone of a sonar at (x, y), to its reading; with a rim where it has read something.
function sonarCone(context, x, y, angle, cone, radius, fill, rim) {
  context.beginPath();
  context.moveTo(x, y);
  context.arc(x, y, radius, -angle - cone / 2, -angle + cone / 2);
  context.closePath();
  context.fillStyle = fill;
  context.fill();
  if (!rim) return;
  context.beginPath();
  context.arc(x, y, radius, -angle - cone / 2, -angle + cone / 2);
  context.strokeStyle = rim;
  context.lineWidth = 1.6;
  context.stroke();
}

function bumperRing(context, x, y, radius, theme) {
  context.beginPath();
  circle(context, x, y, radius + 4);
  context.strokeStyle = theme.alarm;
  context.lineWidth = 3;
  context.stroke();
}
