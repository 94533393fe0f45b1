// Hosts: where each is in the scene, and those without a body as squares with their names.

const MOVED_PX = 0.7;  // lines between hosts are drawn again when one has moved so far

class Hosts {
  constructor(run, bounds) {
    Object.assign(this, { run, bounds });
    this.places = new Float64Array(2 * run.hosts.length);
    this.still = new Float64Array(2 * run.hosts.length).fill(NaN);
    this.moves = 0;
    this.#stand();
  }

  // Put hosts without a body at their places, and those without a place in a row beside the terrain.
  #stand() {
    const { run, bounds, places } = this, spare = [];
    run.hosts.forEach((name, host) => {
      if (run.robotOfHost[host] >= 0) return;
      const fixed = run.about.places[name];
      if (fixed) places.set(fixed, 2 * host); else spare.push(host);
    });
    spare.forEach((host, k) => {
      const share = (k + 1) / (spare.length + 1);
      places[2 * host] = bounds[0] + share * (bounds[2] - bounds[0]);
      places[2 * host + 1] = bounds[1] - 0.045 * (bounds[3] - bounds[1]);
    });
  }

  // Take the robots' places.
  follow(poses) {
    const { places, run: { hostOfRobot } } = this;
    for (let robot = 0; robot < hostOfRobot.length; robot++) {
      const host = hostOfRobot[robot];
      places[2 * host] = poses[3 * robot];
      places[2 * host + 1] = poses[3 * robot + 1];
    }
  }

  // A number that is another one when a host has moved by MOVED_PX since it was the last time.
  movesOf(camera) {
    const { places, still } = this, near = MOVED_PX / camera.scale;
    for (let k = 0; k < places.length; k++) {
      if (Math.abs(places[k] - still[k]) < near) continue;
      still.set(places);
      this.moves += 1;
      break;
    }
    return this.moves;
  }

  x(camera, host) { return camera.sx(this.places[2 * host]); }
  y(camera, host) { return camera.sy(this.places[2 * host + 1]); }

  // The ends of a link in pixels.
  ends(camera, one, other) {
    return [this.x(camera, one), this.y(camera, one), this.x(camera, other), this.y(camera, other)];
  }

  draw(context, camera, view) {
    const { theme, ratio } = view;
    const style = { font: `500 11px ${theme.sans}`, lineHeight: 14, colour: theme.ink,
      halo: theme.halo, ratio };
    context.save();
    context.fillStyle = theme.ink;
    context.strokeStyle = theme.halo;
    context.lineWidth = 2;
    for (let host = 0; host < this.run.hosts.length; host++) {
      if (this.run.robotOfHost[host] >= 0) continue;
      const x = this.x(camera, host), y = this.y(camera, host);
      context.beginPath();
      context.roundRect(x - 6, y - 5, 12, 10, 2);
      context.stroke();
      context.fill();
      putWhereFree(context, view.taken, view.labels.of(this.run.hosts[host], style), [x + 11], y);
    }
    context.restore();
  }
}
