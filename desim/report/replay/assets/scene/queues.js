// Messages that wait at their senders: an arc around each, a full circle for a thousand, and their number.

class Queues {
  constructor(run, hosts, flights) {
    Object.assign(this, { run, hosts, flights });
  }

  draw(context, camera, view) {
    const many = this.run.isLarge, taken = [], { theme, ratio } = view;
    const style = { font: `600 9.5px ${theme.sans}`, lineHeight: 12, colour: theme.alarm,
      halo: theme.halo, ratio };
    const waiting = [...this.flights.waiting].sort((a, b) => b[1] - a[1]);
    context.save();
    context.strokeStyle = theme.alarm;
    context.lineWidth = many ? 1 : 2;
    context.beginPath();
    for (const [host, count] of waiting) queueArc(context, this.hosts.x(camera, host),
      this.hosts.y(camera, host), many ? 5 : 9, count);
    context.stroke();
    for (const [host, count] of many ? [] : waiting) {
      const x = this.hosts.x(camera, host), y = this.hosts.y(camera, host);
      // Where there is room.
      if (taken.some(([tx, ty]) => Math.abs(tx - x) < 22 && Math.abs(ty - y) < 11)) continue;
      taken.push([x, y]);
      const label = view.labels.of(String(count), style);
      putLabel(context, label, x - 12 - label.wide, y);
    }
    context.restore();
  }
}

function queueArc(path, x, y, radius, count) {
  const half = Math.PI * Math.min(1, Math.log10(1 + count) / 3), from = Math.PI - half;
  path.moveTo(x + radius * Math.cos(from), y + radius * Math.sin(from));
  path.arc(x, y, radius, from, Math.PI + half);
}
