// Plans as lines of dots, goals as rings with a point, frontiers as open squares; marks, which
// strategies show, as points with words.

const PLAN = 0, GOAL = 1, FRONTIERS = 2, PATH = 3, POSE = 4, FIRST_MARKS = 5;
const DETAILS_OF_ALL = 3;  // robots: of a larger fleet frontiers and marks of the selected one only

class Plans {
  constructor(run) {
    this.run = run;
    this.lists = plansOf(run);
  }

  // What a host showed last by the time, of a kind; null: nothing, or given up.
  shown(host, kind, timeS) {
    const list = this.lists[host][kind];
    if (!list) return null;
    const at = countUpTo(list.ns, Math.round(timeS * NS)) - 1;
    if (at < 0 || list.counts[at] === 0) return null;
    return { ns: list.ns[at], from: list.offsets[at], count: list.counts[at] };
  }

  key(view) {
    const rows = countUpTo(this.run.plan.at.ns, Math.round(view.timeS * NS));
    return `${view.moves} ${rows} ${view.chosen} ${view.up.changes}`;
  }

  // Whether details of a robot are drawn: the selected one, or any of a small fleet.
  isDetailed(view, robot) {
    return robot === view.chosen || (view.chosen < 0 && this.run.robots.length <= DETAILS_OF_ALL);
  }

  draw(context, camera, view) {
    const { chosen, timeS } = view, { hostOfRobot, robots } = this.run;
    const { x_mm: xs, y_mm: ys } = this.run.planPoint.at;
    const x = (i) => camera.sx(xs[i] / 1000), y = (i) => camera.sy(ys[i] / 1000);
    context.save();
    for (let robot = 0; robot < robots.length; robot++) {
      const strong = robot === chosen, host = hostOfRobot[robot];
      if (!strong && (chosen >= 0 || this.run.isLarge)) continue;
      if (!view.up.robots[robot]) continue;
      context.strokeStyle = context.fillStyle = robotColour(view.theme, robot);
      context.globalAlpha = strong ? 1 : 0.7;
      const plan = this.shown(host, PLAN, timeS), goal = this.shown(host, GOAL, timeS);
      if (plan) {
        context.beginPath();
        this.#ahead(context, camera, view, robot, plan);
        strokePlan(context, strong);
      }
      if (goal) goalMark(context, x(goal.from), y(goal.from), strong);
      if (!this.isDetailed(view, robot)) continue;
      const frontiers = this.shown(host, FRONTIERS, timeS);
      for (let i = 0; i < (frontiers?.count ?? 0); i++) {
        frontierMark(context, x(frontiers.from + i), y(frontiers.from + i));
      }
      this.#marks(context, camera, view, host, robotColour(view.theme, robot));
    }
    context.globalAlpha = 1;
    this.run.hosts.forEach((_, host) => {  // coordinators
      if (this.run.robotOfHost[host] < 0) this.#marks(context, camera, view, host, view.theme.ink);
    });
    context.restore();
  }

  // The points and words that the strategy of a host shows.
  #marks(context, camera, view, host, colour) {
    const { x_mm: xs, y_mm: ys, text } = this.run.planPoint.at, { theme, ratio } = view;
    const style = { font: `500 10px ${theme.sans}`, lineHeight: 12, colour: theme.ink,
      halo: theme.halo, ratio };
    const taken = [];
    context.fillStyle = colour;
    for (let kind = FIRST_MARKS; kind < this.run.about.plan_kinds.length; kind++) {
      const marks = this.shown(host, kind, view.timeS);
      for (let i = marks?.from; i < marks?.from + marks?.count; i++) {
        const sx = camera.sx(xs[i] / 1000), sy = camera.sy(ys[i] / 1000);
        context.beginPath();
        circle(context, sx, sy, 2);
        context.fill();
        const label = view.labels.of(this.run.about.marks[text[i]], style);
        putWhereFree(context, taken, label, [sx + 6, sx - 6 - label.wide], sy)
          || putWhereFree(context, taken, label, [sx + 6, sx - 6 - label.wide], sy + LINE_PX + 2);
      }
    }
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

// By host and kind: the times of what it showed, and where the points stand.
function plansOf(run) {
  const lists = run.hosts.map(() => []);
  const { ns, host, kind, count } = run.plan.at;
  let offset = 0;
  for (let k = 0; k < run.plan.length; k++) {
    const list = lists[host[k]][kind[k]] ??= { ns: [], offsets: [], counts: [] };
    list.ns.push(ns[k]); list.offsets.push(offset); list.counts.push(count[k]);
    offset += count[k];
  }
  return lists;
}
