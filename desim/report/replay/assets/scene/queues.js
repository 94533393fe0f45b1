// Messages that wait at their senders: an arc around each, a full circle for a thousand, and their number.

class Queues {
  constructor(run, hosts, flights) {
    Object.assign(this, { run, hosts, flights });
  }

  draw(context, camera, view) {
    const many = this.run.isLarge, { theme, ratio } = view;
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
      const label = view.labels.of(String(count), style);
      putWhereFree(context, view.taken, label, [this.hosts.x(camera, host) - 12 - label.wide],
        this.hosts.y(camera, host));
    }
    context.restore();
  }
}

function queueArc(path, x, y, radius, count) {
  const half = Math.PI * Math.min(1, Math.log10(1 + count) / 3), from = Math.PI - half;
  path.moveTo(x + radius * Math.cos(from), y + radius * Math.sin(from));
  path.arc(x, y, radius, from, Math.PI + half);
}
