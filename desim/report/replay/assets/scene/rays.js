// Laser beams against the walls: a grid of square tiles, each with the walls that pass through it.

class Rays {
  constructor(walls, tileM = 2) {
    this.walls = walls;
    this.tileM = tileM;
    const xs = walls.flatMap((wall) => [wall.x1, wall.x2]);
    const ys = walls.flatMap((wall) => [wall.y1, wall.y2]);
    this.x0 = xs.reduce((a, b) => Math.min(a, b), 0) - 1;
    this.y0 = ys.reduce((a, b) => Math.min(a, b), 0) - 1;
    this.columns = Math.ceil((xs.reduce((a, b) => Math.max(a, b), 0) + 1 - this.x0) / tileM) + 1;
    this.rows = Math.ceil((ys.reduce((a, b) => Math.max(a, b), 0) + 1 - this.y0) / tileM) + 1;
    this.tiles = new Map();
    this.flat = new Float64Array(4 * walls.length);
    walls.forEach((wall, k) => this.#enter(wall, k));
  }

  #enter(wall, k) {
    this.flat.set([wall.x1, wall.y1, wall.x2 - wall.x1, wall.y2 - wall.y1], 4 * k);
    const column = (x) => Math.floor((x - this.x0) / this.tileM);
    const row = (y) => Math.floor((y - this.y0) / this.tileM);
    const low = [column(Math.min(wall.x1, wall.x2) - 1e-6), row(Math.min(wall.y1, wall.y2) - 1e-6)];
    const high = [column(Math.max(wall.x1, wall.x2) + 1e-6), row(Math.max(wall.y1, wall.y2) + 1e-6)];
    const dx = wall.x2 - wall.x1, dy = wall.y2 - wall.y1, reach = this.tileM * 0.7072 + 1e-6;
    const length = Math.hypot(dx, dy) || 1;
    for (let r = low[1]; r <= high[1]; r++) {
      for (let c = low[0]; c <= high[0]; c++) {
        const mx = this.x0 + (c + 0.5) * this.tileM, my = this.y0 + (r + 0.5) * this.tileM;
        if (Math.abs((mx - wall.x1) * dy - (my - wall.y1) * dx) / length > reach) continue;
        const tile = r * this.columns + c;
        if (!this.tiles.has(tile)) this.tiles.set(tile, []);
        this.tiles.get(tile).push(k);
      }
    }
  }

  // How far a beam gets from (x, y) in the direction (ux, uy), at most `range`.
  cast(x, y, ux, uy, range) {
    const size = this.tileM;
    let c = Math.floor((x - this.x0) / size), r = Math.floor((y - this.y0) / size);
    const stepC = ux > 0 ? 1 : -1, stepR = uy > 0 ? 1 : -1;
    const edgeX = this.x0 + (c + (ux > 0 ? 1 : 0)) * size;
    const edgeY = this.y0 + (r + (uy > 0 ? 1 : 0)) * size;
    let nextX = ux === 0 ? Infinity : (edgeX - x) / ux;
    let nextY = uy === 0 ? Infinity : (edgeY - y) / uy;
    const perX = ux === 0 ? Infinity : size / Math.abs(ux);
    const perY = uy === 0 ? Infinity : size / Math.abs(uy);
    let nearest = range, entered = 0;
    while (entered < nearest) {
      const tile = c >= 0 && r >= 0 && c < this.columns ? this.tiles.get(r * this.columns + c) : null;
      if (tile) {
        for (let i = 0; i < tile.length; i++) nearest = this.#hit(4 * tile[i], x, y, ux, uy, nearest);
      }
      if (nextX < nextY) { entered = nextX; nextX += perX; c += stepC; }
      else { entered = nextY; nextY += perY; r += stepR; }
    }
    return nearest;
  }

  #hit(at, x, y, ux, uy, nearest) {
    const wx = this.flat[at + 2], wy = this.flat[at + 3];
    const across = ux * wy - uy * wx;
    if (across === 0) return nearest;
    const px = this.flat[at] - x, py = this.flat[at + 1] - y;
    const along = (px * wy - py * wx) / across;
    if (along < 0 || along >= nearest) return nearest;
    const share = (px * uy - py * ux) / across;
    return share < -1e-9 || share > 1 + 1e-9 ? nearest : along;
  }
}
