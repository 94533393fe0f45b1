// The ways that robots have driven: the whole of each thin, the last seconds strong.

const RECENT_S = 12;
const PATH_OPACITY = { alone: 0.33, below: 0.15 };  // below those of the selected robot
const LEAST_PX = 1.2;  // nearer points add nothing to a line

// The whole ways, thin.
class Paths {
  constructor(run, style) {
    Object.assign(this, { run, style });
    this.drawn = -1;  // the sample up to which the lines go
    this.pen = null;  // pixels where each robot's line has got to
  }

  // Lines that go on beyond the instant are drawn anew: somebody has gone back in time.
  key(view) {
    const [at] = this.run.poseIndex(view.timeS);
    return `${view.chosen} ${this.drawn > at ? this.drawn : ""}`;
  }

  draw(context, camera, view) {
    this.drawn = -1;
    this.pen = this.run.robots.map(() => null);
    this.grow(context, camera, view);
  }

  grow(context, camera, view) {
    const [at] = this.run.poseIndex(view.timeS);
    if (this.drawn < at) this.#extend(context, at, camera, view);
  }

  // Continue the lines up to a sample.
  #extend(context, at, camera, view) {
    const { x_mm: xs, y_mm: ys } = this.run.pose.at, from = Math.max(0, this.drawn);
    const faint = PATH_OPACITY[view.chosen >= 0 ? "below" : "alone"];
    context.save();
    context.lineWidth = 1;
    context.lineJoin = "round";
    context.setLineDash(this.style.dash);
    for (let robot = 0; robot < this.run.robots.length; robot++) {
      context.strokeStyle = alpha(robotColour(view.theme, robot), faint);
      context.beginPath();
      let [px, py] = this.pen[robot]
        ?? [camera.sx(xs[robot][from] / 1000), camera.sy(ys[robot][from] / 1000)];
      context.moveTo(px, py);
      for (let i = from; i <= at; i++) {
        const x = camera.sx(xs[robot][i] / 1000), y = camera.sy(ys[robot][i] / 1000);
        if (Math.abs(x - px) + Math.abs(y - py) < LEAST_PX) continue;
        context.lineTo(x, y);
        px = x; py = y;
      }
      context.stroke();
      this.pen[robot] = [px, py];
    }
    context.restore();
    this.drawn = at;
  }
}

// Their last seconds, strong.
class Trails {
  constructor(run, style) {
    Object.assign(this, { run, style });
  }

  key(view) {
    return `${view.moves} ${this.run.poseIndex(view.timeS)[0]} ${view.chosen}`;
  }

  draw(context, camera, view) {
    const [at] = this.run.poseIndex(view.timeS);
    const { chosen } = view;
    context.save();
    context.lineCap = "round";
    context.lineJoin = "round";
    context.lineWidth = 1.7;
    if (this.run.isLarge) {
      this.#crowd(context, camera, view, at, chosen >= 0 ? 0.35 : view.theme.trail);
      if (chosen >= 0) this.#fading(context, camera, view, at, chosen, chosen);
    } else {
      this.run.robots.forEach((_, robot) => this.#fading(context, camera, view, at, robot, chosen));
    }
    context.restore();
  }

  #since(timeS) {
    return Math.max(0, countUpTo(this.run.pose.at.ns, (timeS - RECENT_S) * NS, this.run.pose.length) - 1);
  }

  // The last seconds of many robots: those of one colour at once.
  #crowd(context, camera, view, at, opacity) {
    const { x_mm: xs, y_mm: ys } = this.run.pose.at, from = this.#since(view.timeS);
    const count = this.run.robots.length;
    context.globalAlpha = opacity * this.style.opacity;
    for (let hue = 0; hue < HUES; hue++) {
      context.strokeStyle = view.theme.hues[hue];
      context.beginPath();
      for (let robot = hue; robot < count; robot += HUES) {
        this.#line(context, camera, xs[robot], ys[robot], from, at);
      }
      context.stroke();
    }
  }

  // The last seconds of one robot, fading; all of the selected one.
  #fading(context, camera, view, at, robot, chosen) {
    const { x_mm: xs, y_mm: ys } = this.run.pose.at, strong = robot === chosen;
    const from = strong ? 0 : this.#since(view.timeS), parts = strong ? 1 : 3;
    context.strokeStyle = robotColour(view.theme, robot);
    for (let part = 0; part < parts; part++) {
      const begin = from + Math.floor((at - from) * part / parts);
      const end = from + Math.floor((at - from) * (part + 1) / parts);
      if (end <= begin && part < parts - 1) continue;
      context.globalAlpha = (strong ? 0.9 : (chosen >= 0 ? 0.35 : view.theme.trail))
        * (part + 1) / parts * this.style.opacity;
      context.beginPath();
      this.#line(context, camera, xs[robot], ys[robot], begin, end);
      if (part === parts - 1) {
        context.lineTo(camera.sx(view.poses[3 * robot]), camera.sy(view.poses[3 * robot + 1]));
      }
      context.stroke();
    }
  }

  #line(context, camera, x, y, begin, end) {
    let px = camera.sx(x[begin] / 1000), py = camera.sy(y[begin] / 1000);
    context.moveTo(px, py);
    for (let i = begin + 1; i <= end; i++) {
      const sx = camera.sx(x[i] / 1000), sy = camera.sy(y[i] / 1000);
      if (i < end && Math.abs(sx - px) + Math.abs(sy - py) < LEAST_PX) continue;
      context.lineTo(sx, sy);
      px = sx; py = sy;
    }
  }
}
