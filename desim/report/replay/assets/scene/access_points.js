// Access points with their channels, a thin line from each host to the one on which it hangs, and a
// mark beside robots that hang on none.

const MAST_PX = 2.5;  // the radius of the dot in the middle

class Associations {
  constructor(run, hosts) {
    Object.assign(this, { run, hosts });
    this.points = run.about.access_points;
    this.states = new PairStates(run.association, run, "host", "access_point", "hangs", this.points);
  }

  key(view) {
    this.states.at(view.timeS);
    return [view.moves, this.states.next, view.up.changes, view.selected].join();
  }

  // The numbers of the access points on which a host hangs.
  of(host, timeS) {
    const values = this.states.at(timeS), begin = host * this.points.length;
    return [...this.points.keys()].filter((point) => values[begin + point]);
  }

  draw(context, camera, view) {
    const { run, hosts, points } = this;
    context.save();
    for (const host of run.about.stations) {
      const robot = run.robotOfHost[host];
      if (robot >= 0 && !view.up.robots[robot]) continue;
      context.lineWidth = robot >= 0 && robot === view.chosen ? 2.6 : 1.6;
      context.strokeStyle = robot < 0 ? view.theme.ink : robotColour(view.theme, robot);
      for (const point of this.of(host, view.timeS)) {
        const { x_m: x, y_m: y } = points[point];
        associationLine(context, hosts.x(camera, host), hosts.y(camera, host), camera.sx(x),
          camera.sy(y));
      }
    }
    context.restore();
  }
}

class AccessPoints {
  constructor(run, associations) {
    Object.assign(this, { run, associations });
  }

  draw(context, camera, view) {
    const { theme, ratio } = view;
    const style = { font: `500 10.5px ${theme.sans}`, lineHeight: 13, colour: theme.ink,
      halo: theme.halo, ratio };
    context.save();
    for (const { name, channel, x_m: x, y_m: y } of this.run.about.access_points) {
      const sx = camera.sx(x), sy = camera.sy(y);
      accessPointMark(context, sx, sy, theme);
      const label = view.labels.of(`${name} · ch ${channel}`, style);
      const isIn = (left) => left > 0 && left + label.wide < camera.width;
      if (!putWhereFree(context, view.taken, label, [sx + 12, sx - 12 - label.wide].filter(isIn),
        sy + 8)) putWhereFree(context, view.taken, label, [sx - label.wide / 2].filter(isIn), sy + 18);
    }
    for (const host of this.run.about.stations) {
      const robot = this.run.robotOfHost[host];
      if (robot < 0 || !view.up.robots[robot] || this.associations.of(host, view.timeS).length) continue;
      const away = robotRadius(this.run, camera, robot) + 6;
      noAccessPointMark(context, camera.sx(view.poses[3 * robot]) + away,
        camera.sy(view.poses[3 * robot + 1]) + away, theme);
    }
    context.restore();
  }
}

// Dots: a plan's line has dashes.
function associationLine(context, x1, y1, x2, y2) {
  context.lineCap = "round";
  context.setLineDash([0, 5]);
  context.beginPath();
  line(context, x1, y1, x2, y2);
  context.stroke();
  context.setLineDash([]);
}

// A dot between waves.
function accessPointMark(context, x, y, theme) {
  const waves = () => {
    context.beginPath();
    for (const radius of [6, 9.5]) {
      for (const middle of [0, Math.PI]) {
        const from = middle - 0.7;
        context.moveTo(x + radius * Math.cos(from), y + radius * Math.sin(from));
        context.arc(x, y, radius, from, middle + 0.7);
      }
    }
    context.moveTo(x + MAST_PX, y);
    context.arc(x, y, MAST_PX, 0, 2 * Math.PI);
    context.stroke();
  };
  Object.assign(context, { strokeStyle: theme.halo, lineWidth: 4, lineCap: "round" });
  waves();
  Object.assign(context, { strokeStyle: theme.ink, fillStyle: theme.ink, lineWidth: 1.5 });
  waves();
  context.beginPath();
  circle(context, x, y, MAST_PX);
  context.fill();
}

// Waves above a dot, and a cross.
function noAccessPointMark(context, x, y, theme) {
  const shape = () => {
    context.beginPath();
    for (const radius of [0.5, 4.5, 8.5]) {
      context.moveTo(x - radius * Math.SQRT1_2, y + 4 - radius * Math.SQRT1_2);
      context.arc(x, y + 4, radius, -0.75 * Math.PI, -0.25 * Math.PI);
    }
    cross(context, x + 7, y + 3, 2.5);
    context.stroke();
  };
  Object.assign(context, { strokeStyle: theme.halo, lineWidth: 4, lineCap: "round" });
  shape();
  Object.assign(context, { strokeStyle: theme.alarm, lineWidth: 1.5 });
  shape();
}
