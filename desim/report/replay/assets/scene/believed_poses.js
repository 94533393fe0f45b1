// The poses that SLAM has found: a ring where a robot takes itself to be, joined to where it is, and
// of the selected robot the path that it last corrected.

class BelievedPoses {
  constructor(run, plans) {
    Object.assign(this, { run, plans });
    this.errors = new Map();  // by host and instant: how far off the pose was, x and y in m
  }

  draw(context, camera, view) {
    context.save();
    this.run.robots.forEach((_, robot) => {
      const strong = robot === view.chosen;
      if (!view.up.robots[robot] || (!strong && (view.chosen >= 0 || this.run.isLarge))) return;
      context.strokeStyle = robotColour(view.theme, robot);
      if (strong) this.#path(context, camera, view, robot);
      this.#ring(context, camera, view, robot);
    });
    context.restore();
  }

  // Between two scans the error is taken for what it was at the first.
  #ring(context, camera, view, robot) {
    const error = this.#error(robot, view.timeS);
    if (!error) return;
    const x = view.poses[3 * robot], y = view.poses[3 * robot + 1];
    believedRing(context, camera.sx(x), camera.sy(y), camera.sx(x + error[0]),
      camera.sy(y + error[1]), robotRadius(this.run, camera, robot));
  }

  #error(robot, timeS) {
    const pose = this.plans.shown(this.run.hostOfRobot[robot], POSE, timeS);
    if (!pose) return null;
    const key = `${robot} ${pose.ns}`;
    if (!this.errors.has(key)) {
      const { x_mm: xs, y_mm: ys } = this.run.planPoint.at, poses = this.run.posesAt(pose.ns / NS);
      this.errors.set(key, [xs[pose.from] / 1000 - poses[3 * robot],
        ys[pose.from] / 1000 - poses[3 * robot + 1]]);
    }
    return this.errors.get(key);
  }

  #path(context, camera, view, robot) {
    const { x_mm: xs, y_mm: ys } = this.run.planPoint.at;
    const path = this.plans.shown(this.run.hostOfRobot[robot], PATH, view.timeS);
    if (!path) return;
    context.beginPath();
    for (let i = path.from; i < path.from + path.count; i++) {
      context.lineTo(camera.sx(xs[i] / 1000), camera.sy(ys[i] / 1000));
    }
    context.setLineDash([8, 3]);
    context.lineWidth = 1;
    context.stroke();
    context.setLineDash([]);
  }
}

function believedRing(context, x, y, believedX, believedY, radius) {
  context.lineWidth = 1.2;
  context.beginPath();
  circle(context, believedX, believedY, radius + 2.5);
  context.stroke();
  context.beginPath();
  line(context, x, y, believedX, believedY);
  context.stroke();
}
