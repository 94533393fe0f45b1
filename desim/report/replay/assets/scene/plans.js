// Plans as lines of dots, goals as rings with a point, frontiers as open squares.

const PLAN = 0, GOAL = 1, FRONTIERS = 2;
const FRONTIERS_OF_ALL = 3;  // robots: of a larger fleet the frontiers of the selected one only

class Plans {
  constructor(run) {
    this.run = run;
    this.lists = plansOf(run);
  }

  // The last plan, goal or frontiers that a robot showed by the time; null: none, or given up.
  shown(robot, kind, timeS) {
    const list = this.lists[robot][kind], at = countUpTo(list.ns, Math.round(timeS * NS)) - 1;
    if (at < 0 || list.counts[at] === 0) return null;
    return { from: list.offsets[at], count: list.counts[at] };
  }

  key(view) {
    if (!this.#areDrawn(view)) return "";
    const rows = countUpTo(this.run.plan.at.ns, Math.round(view.timeS * NS));
    return `${view.moves} ${rows} ${view.chosen} ${view.up.changes}`;
  }

  #areDrawn(view) {
    return view.chosen >= 0 || !this.run.isLarge;
  }

  draw(context, camera, view) {
    const count = this.run.robots.length, { chosen, timeS } = view;
    if (!this.#areDrawn(view)) return;
    const { x_mm: xs, y_mm: ys } = this.run.planPoint.at;
    const x = (i) => camera.sx(xs[i] / 1000), y = (i) => camera.sy(ys[i] / 1000);
    context.save();
    for (let robot = 0; robot < count; robot++) {
      const strong = robot === chosen;
      if ((chosen >= 0 && !strong) || !view.up.robots[robot]) continue;
      context.strokeStyle = context.fillStyle = robotColour(view.theme, robot);
      context.globalAlpha = strong ? 1 : 0.7;
      const plan = this.shown(robot, PLAN, timeS), goal = this.shown(robot, GOAL, timeS);
      if (plan) {
        context.beginPath();
        this.#ahead(context, camera, view, robot, plan);
        strokePlan(context, strong);
      }
      if (goal) goalMark(context, x(goal.from), y(goal.from), strong);
      const frontiers = strong || count <= FRONTIERS_OF_ALL
        ? this.shown(robot, FRONTIERS, timeS) : null;
      for (let i = 0; i < (frontiers?.count ?? 0); i++) {
        frontierMark(context, x(frontiers.from + i), y(frontiers.from + i));
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
    let px = camera.sx(x / 1000), py = camera.sy(y / 1000);
    context.moveTo(px, py);
    for (let i = Math.min(nearest + 1, end - 1); i < end; i++) {
      const sx = camera.sx(xs[i] / 1000), sy = camera.sy(ys[i] / 1000);
      if (i < end - 1 && Math.abs(sx - px) + Math.abs(sy - py) < LEAST_PX) continue;
      context.lineTo(sx, sy);
      px = sx; py = sy;
    }
  }
}

function strokePlan(context, strong) {
  context.setLineDash(strong ? [5, 4] : [1.5, 4]);
  context.lineCap = "round";
  context.lineWidth = strong ? 1.6 : 1.3;
  context.stroke();
  context.setLineDash([]);
}

function goalMark(context, x, y, strong) {
  context.lineWidth = strong ? 1.8 : 1.3;
  context.beginPath();
  circle(context, x, y, strong ? 6 : 4);
  context.stroke();
  context.beginPath();
  circle(context, x, y, strong ? 2.2 : 1.4);
  context.fill();
}

function frontierMark(context, x, y) {
  context.lineWidth = 1.3;
  context.strokeRect(x - 3, y - 3, 6, 6);
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
