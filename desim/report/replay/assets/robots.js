// Robots: bodies with headings, laser fans, plans, goals and frontiers, names.

const PLAN = 0, GOAL = 1, FRONTIERS = 2;
const LEAST_RADIUS_PX = 3;
const NAME_PX = 10;       // between the lines of two names
const LIT_TOGETHER = 12;  // robots: beyond, all fans are one area

class Robots {
  constructor(run) {
    this.run = run;
    this.plans = plansOf(run);
  }

  // The last plan, goal or frontiers that a robot showed by the time; null: none, or given up.
  shown(robot, kind, timeS) {
    const list = this.plans[robot][kind], at = countUpTo(list.ns, Math.round(timeS * NS)) - 1;
    if (at < 0 || list.counts[at] === 0) return null;
    return { from: list.offsets[at], count: list.counts[at] };
  }

  // Each fan in its robot's colour; those of a larger fleet are one area of light.
  fans(context, camera, view, rays, only) {
    const laser = this.run.about.laser, count = this.run.robots.length;
    if (!laser) return;  // of an imported run
    const together = count > LIT_TOGETHER && only === null ? new Path2D() : null;
    for (let robot = 0; robot < count; robot++) {
      if (only !== null && robot !== only) continue;
      if (!this.run.isUp(robot, view.timeS)) continue;
      const [x, y] = view.poses.subarray(3 * robot, 3 * robot + 2);
      const reach = laser.range_m * camera.scale, sx = camera.sx(x), sy = camera.sy(y);
      if (sx < -reach || sy < -reach || sx > camera.width + reach || sy > camera.height + reach) {
        continue;
      }
      const path = together ?? new Path2D();
      this.#fan(path, camera, view, rays, robot, Math.min(laser.beams, together ? 72 : laser.beams));
      if (together) continue;
      const colour = robotColour(view.theme, robot);
      context.fillStyle = alpha(colour, only === robot ? 0.2 : view.theme.fan);
      context.fill(path);
      if (only === robot) {
        context.strokeStyle = alpha(colour, 0.5);
        context.lineWidth = 0.75;
        context.stroke(path);
      }
    }
    if (together) {
      context.fillStyle = view.theme.lit;
      context.fill(together);
    }
  }

  #fan(path, camera, view, rays, robot, beams) {
    const laser = this.run.about.laser;
    const [x, y, yaw] = view.poses.subarray(3 * robot, 3 * robot + 3);
    path.moveTo(camera.sx(x), camera.sy(y));
    for (let beam = 0; beam < beams; beam++) {
      const angle = yaw + laser.field_of_view_rad * (beam / (beams - 1) - 0.5);
      const ux = Math.cos(angle), uy = Math.sin(angle);
      const range = rays.cast(x, y, ux, uy, laser.range_m);
      path.lineTo(camera.sx(x + ux * range), camera.sy(y + uy * range));
    }
    path.closePath();
  }

  // Plans as lines of dots, goals as rings with a point, frontiers as open squares.
  intents(context, camera, view, only) {
    const { x_mm: xs, y_mm: ys } = this.run.planPoint.at;
    context.save();
    for (let robot = 0; robot < this.run.robots.length; robot++) {
      const chosen = robot === only;
      if ((only !== null && !chosen) || !this.run.isUp(robot, view.timeS)) continue;
      const colour = robotColour(view.theme, robot);
      context.strokeStyle = context.fillStyle = colour;
      context.globalAlpha = chosen ? 1 : 0.7;
      const plan = this.shown(robot, PLAN, view.timeS);
      if (plan) {
        context.setLineDash(chosen ? [5, 4] : [1.5, 4]);
        context.lineCap = "round";
        context.lineWidth = chosen ? 1.6 : 1.3;
        context.beginPath();
        this.#ahead(context, camera, view, robot, plan);
        context.stroke();
        context.setLineDash([]);
      }
      const goal = this.shown(robot, GOAL, view.timeS);
      if (goal) {
        const gx = camera.sx(xs[goal.from] / 1000), gy = camera.sy(ys[goal.from] / 1000);
        context.lineWidth = chosen ? 1.8 : 1.3;
        context.beginPath();
        context.arc(gx, gy, chosen ? 6 : 4, 0, 2 * Math.PI);
        context.stroke();
        context.beginPath();
        context.arc(gx, gy, chosen ? 2.2 : 1.4, 0, 2 * Math.PI);
        context.fill();
      }
      const frontiers = chosen || this.run.robots.length <= 3
        ? this.shown(robot, FRONTIERS, view.timeS) : null;
      if (frontiers) {
        context.lineWidth = 1.3;
        for (let i = frontiers.from; i < frontiers.from + frontiers.count; i++) {
          context.strokeRect(camera.sx(xs[i] / 1000) - 3, camera.sy(ys[i] / 1000) - 3, 6, 6);
        }
      }
    }
    context.restore();
  }

  // The part of a plan that is still to be driven, from the point nearest to the robot.
  #ahead(context, camera, view, robot, plan) {
    const { x_mm: xs, y_mm: ys } = this.run.planPoint.at, end = plan.from + plan.count;
    const x = 1000 * view.poses[3 * robot], y = 1000 * view.poses[3 * robot + 1];
    let nearest = plan.from, least = Infinity;
    for (let i = plan.from; i < end; i++) {
      const away = (xs[i] - x) ** 2 + (ys[i] - y) ** 2;
      if (away <= least) { least = away; nearest = i; }
    }
    context.moveTo(camera.sx(x / 1000), camera.sy(y / 1000));
    for (let i = nearest + 1; i < end; i++) {
      context.lineTo(camera.sx(xs[i] / 1000), camera.sy(ys[i] / 1000));
    }
    if (nearest + 1 >= end) context.lineTo(camera.sx(xs[end - 1] / 1000), camera.sy(ys[end - 1] / 1000));
  }

  // People and carts: discs of the terrain's colour.
  obstacles(context, camera, view) {
    context.save();
    context.fillStyle = view.theme.wall;
    context.strokeStyle = view.theme.halo;
    context.lineWidth = 1.5;
    for (const [x, y, radius] of this.run.obstaclesAt(view.timeS)) {
      context.beginPath();
      context.arc(camera.sx(x), camera.sy(y), Math.max(3, radius * camera.scale), 0, 2 * Math.PI);
      context.stroke();
      context.fill();
    }
    context.restore();
  }

  bodies(context, camera, view) {
    const chosen = view.selection.kind === "robot" ? view.selection.robot : -1;
    const count = this.run.robots.length, crowd = new Map();
    context.save();
    // The selected one last, over all others.
    for (let k = 0; k <= count; k++) {
      const robot = k === count ? chosen : k;
      if (robot < 0 || (k === chosen && k < count)) continue;
      const sx = camera.sx(view.poses[3 * robot]), sy = camera.sy(view.poses[3 * robot + 1]);
      if (sx < -20 || sy < -20 || sx > camera.width + 20 || sy > camera.height + 20) continue;
      const colour = robotColour(view.theme, robot), radius = this.radius(camera, robot);
      const up = this.run.isUp(robot, view.timeS);
      if (count > MANY_ROBOTS && up && robot !== chosen && !view.ghost) {
        if (!crowd.has(colour)) crowd.set(colour, new Path2D());
        outline(crowd.get(colour), sx, sy, view.poses[3 * robot + 2], radius);
        continue;
      }
      if (k === count) this.#crowd(context, crowd, view, true);
      body(context, sx, sy, view.poses[3 * robot + 2], radius, { colour, theme: view.theme, up,
        ghost: view.ghost, chosen: robot === chosen, faded: chosen >= 0 && robot !== chosen });
    }
    this.#crowd(context, crowd, view, chosen >= 0);
    context.restore();
  }

  // Many bodies: those of one colour at once.
  #crowd(context, crowd, view, faded) {
    context.globalAlpha = faded ? 0.55 : 1;
    context.strokeStyle = view.theme.halo;
    context.lineWidth = 2;
    for (const [colour, path] of crowd) {
      context.stroke(path);
      context.fillStyle = colour;
      context.fill(path);
    }
    crowd.clear();
  }

  radius(camera, robot) {
    const least = this.run.robots.length > 100 ? 2.4 : LEAST_RADIUS_PX;
    return Math.max(least, this.run.about.radius_m[robot] * camera.scale);
  }

  // Names where there is room, to the right or to the left: first the selected robot's, then in
  // order.
  names(context, camera, view) {
    const count = this.run.robots.length, chosen = view.selection.kind === "robot"
      ? view.selection.robot : -1;
    if (count > 100 && camera.scale < 12 && chosen < 0) return;
    const taken = [];
    const order = [...Array(count).keys()].sort((a, b) => (b === chosen) - (a === chosen));
    context.save();
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.lineJoin = "round";
    for (const robot of order) {
      if (count > 100 && camera.scale < 12 && robot !== chosen) break;
      const radius = this.radius(camera, robot);
      const sx = camera.sx(view.poses[3 * robot]);
      const y = camera.sy(view.poses[3 * robot + 1]) - radius - 2;
      context.font = `${robot === chosen ? 600 : 500} ${robot === chosen ? 12 : 10.5}px ${FONT}`;
      const text = robot === chosen ? this.run.robots[robot] : shortName(this.run.robots[robot]);
      const wide = context.measureText(text).width, away = radius + 3;
      const x = [sx + away, sx - away - wide].find((left) => taken.every(([from, until, line]) =>
        left > until || left + wide < from || Math.abs(line - y) > NAME_PX));
      if (x === undefined) continue;
      taken.push([x, x + wide, y]);
      context.globalAlpha = chosen >= 0 && robot !== chosen ? 0.45 : 1;
      context.strokeStyle = view.theme.halo;
      context.lineWidth = 3;
      context.strokeText(text, x, y);
      context.fillStyle = view.theme.ink;
      context.fillText(text, x, y);
    }
    context.restore();
  }
}

// A disc with its nose in front; a ghost is hollow, a robot whose host is down is crossed out.
function body(context, sx, sy, yaw, radius, { colour, theme, ghost, chosen, up, faded }) {
  context.globalAlpha = faded ? 0.55 : 1;
  context.beginPath();
  outline(context, sx, sy, yaw, radius);
  if (chosen) {
    context.strokeStyle = alpha(theme.accent, 0.4);
    context.lineWidth = 10;
    context.stroke();
  }
  if (ghost || !up) {
    context.fillStyle = alpha(theme.halo, ghost ? 0.3 : 0.8);
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
  if (!up) {
    const arm = radius * 1.3;
    context.strokeStyle = theme.alarm;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(sx - arm, sy - arm); context.lineTo(sx + arm, sy + arm);
    context.moveTo(sx - arm, sy + arm); context.lineTo(sx + arm, sy - arm);
    context.stroke();
  }
}

function outline(path, sx, sy, yaw, radius) {
  const nose = radius * 1.75, cheek = 0.62;
  path.moveTo(sx + nose * Math.cos(yaw), sy - nose * Math.sin(yaw));
  path.lineTo(sx + radius * Math.cos(yaw + cheek), sy - radius * Math.sin(yaw + cheek));
  path.arc(sx, sy, radius, -(yaw + cheek), -(yaw - cheek), true);
  path.closePath();
}

// By robot and kind: the times of its plans, and where their points stand.
function plansOf(run) {
  const lists = run.robots.map(() => [0, 1, 2].map(() => ({ ns: [], offsets: [], counts: [] })));
  const { ns, robot, kind, count } = run.plan.at;
  let offset = 0;
  for (let k = 0; k < run.plan.length; k++) {
    const list = lists[robot[k]][kind[k]];
    list.ns.push(ns[k]); list.offsets.push(offset); list.counts.push(count[k]);
    offset += count[k];
  }
  return lists;
}
