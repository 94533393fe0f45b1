// Messages under way: dots of their senders' colours, rings around late ones, triangles for lost ones.

const LEAST_FLIGHT_S = 0.45;   // of the viewer's time: a message is seen at least so long
const LOST_S = 0.7;            // likewise: the triangle of a lost one
const FEW = 160;               // more of them are drawn smaller
const SQUARE_PX = 1.3;         // dots of a smaller radius are squares of the same area: they look alike
const FADES = 4;               // so many steps of a triangle's opacity

class Flights {
  constructor(run, hosts, traffic) {
    Object.assign(this, { run, hosts, traffic });
    this.waiting = new Map();  // by host: the messages that wait there, as drawn last
    // Kept from frame to frame: x, y, message, ... of the dots by colour, x, y of lost ones by opacity.
    this.dots = Array.from({ length: HUES + 1 }, () => []);
    this.lost = Array.from({ length: FADES }, () => []);
  }

  draw(context, camera, view) {
    const count = this.#place(camera, view);
    const finer = Math.min(1, Math.sqrt(FEW / Math.max(1, count)));
    context.save();
    this.#dots(context, view, finer);
    this.#rings(context, view, finer);
    context.strokeStyle = view.theme.alarm;
    context.lineWidth = 1.6;
    this.lost.forEach((places, fade) => {
      if (!places.length) return;
      context.globalAlpha = (fade + 1) / FADES * (0.25 + 0.75 * finer);
      context.beginPath();
      for (let i = 0; i < places.length; i += 2) drop(context, places[i], places[i + 1], 1.2 + 2 * finer);
      context.stroke();
    });
    context.restore();
  }

  // Find where each is; the number of those that are drawn.
  #place(camera, view) {
    const { run, traffic, hosts: { places }, dots, lost: gone } = this, at = run.message.at;
    const least = LEAST_FLIGHT_S * Math.max(0.25, view.speed);
    const after = LOST_S * Math.max(0.25, view.speed), { selection } = view;
    const family = selection.kind === "family" ? selection.family : -1;
    const isAll = family < 0 && !isNarrow(run, selection);
    const waiting = this.waiting = new Map();
    let count = 0;
    for (const list of dots) list.length = 0;
    for (const list of gone) list.length = 0;
    traffic.inFlight(view.timeS, least, after, (k, share, goneS) => {
      const source = at.source[k], destination = at.destination[k], lost = at.reason[k] > 0;
      if (!isAll && (!isLit(run, selection, source, destination)
        || (family >= 0 && run.about.topic_family[at.topic[k]] !== family))) return;
      if (traffic.waits(k, view.timeS)) {
        waiting.set(source, (waiting.get(source) ?? 0) + 1);
        return;
      }
      const way = lost ? 0.5 * share : share, x0 = places[2 * source], y0 = places[2 * source + 1];
      const x = camera.sx(x0 + way * (places[2 * destination] - x0));
      const y = camera.sy(y0 + way * (places[2 * destination + 1] - y0));
      count += 1;
      if (lost && (share >= 1 || goneS > 0)) {
        gone[Math.min(FADES - 1, Math.floor(FADES * (1 - goneS / after)))]?.push(x, y);
        return;
      }
      const robot = run.robotOfHost[source];
      dots[robot < 0 ? HUES : robot % HUES].push(x, y, k);
    });
    return count;
  }

  radius(k, finer) {
    return (1.1 + 0.3 * Math.log10(1 + this.run.message.at.size_bytes[k] / 100))
      * (0.55 + 0.45 * finer);
  }

  // Dots of one colour at once.
  #dots(context, view, finer) {
    context.globalAlpha = 0.95;
    this.dots.forEach((list, hue) => {
      if (!list.length) return;
      context.fillStyle = view.theme.hues[hue] ?? view.theme.ink;
      context.beginPath();
      for (let i = 0; i < list.length; i += 3) {
        const radius = this.radius(list[i + 2], finer), side = radius * Math.sqrt(Math.PI);
        if (radius > SQUARE_PX) circle(context, list[i], list[i + 1], radius);
        else context.fillRect(list[i] - side / 2, list[i + 1] - side / 2, side, side);
      }
      context.fill();
    });
  }

  // Around late messages, and around the selected one.
  #rings(context, view, finer) {
    const { born_us: born } = this.run.message.at, { selection } = view;
    let chosen = null;
    context.beginPath();
    for (const list of this.dots) {
      for (let i = 0; i < list.length; i += 3) {
        const [x, y, k] = [list[i], list[i + 1], list[i + 2]];
        if (selection.kind === "message" && selection.message === k) chosen = [x, y];
        if (view.timeS - born[k] / 1e6 >= LATE_S && this.traffic.isLate(k)) {
          circle(context, x, y, this.radius(k, finer) + 0.6 + finer);
        }
      }
    }
    context.strokeStyle = view.theme.alarm;
    context.globalAlpha = 0.3 + 0.6 * finer;
    context.lineWidth = 0.5 + 0.6 * finer;
    context.stroke();
    if (!chosen) return;
    context.globalAlpha = 1;
    context.strokeStyle = view.theme.ink;
    context.lineWidth = 2;
    context.beginPath();
    circle(context, ...chosen, 7);
    context.stroke();
  }
}
