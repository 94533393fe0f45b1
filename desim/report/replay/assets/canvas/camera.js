// The view of the plane: which metre is at which pixel.

class Camera {
  constructor() {
    this.width = 1; this.height = 1;   // pixels of the page
    this.x = 0; this.y = 0;            // the point in m in the middle
    this.scale = 1;                    // pixels a metre
    this.version = 0;                  // changes with every move
    this.least = 0.1;
  }

  resize(width, height) {
    if (width === this.width && height === this.height) return;
    this.width = width; this.height = height;
    this.version += 1;
  }

  // Show the whole rectangle, with a margin in pixels.
  fit([x0, y0, x1, y1], { side = 24, top = 24, bottom = 24 } = {}) {
    const wide = Math.max(1, this.width - 2 * side);
    const high = Math.max(1, this.height - top - bottom);
    this.scale = Math.min(wide / Math.max(1e-3, x1 - x0), high / Math.max(1e-3, y1 - y0));
    this.least = this.scale / 3;
    this.x = (x0 + x1) / 2; this.y = (y0 + y1) / 2 + (top - bottom) / 2 / this.scale;
    this.version += 1;
  }

  sx(x) { return (x - this.x) * this.scale + this.width / 2; }
  sy(y) { return this.height / 2 - (y - this.y) * this.scale; }
  wx(sx) { return (sx - this.width / 2) / this.scale + this.x; }
  wy(sy) { return (this.height / 2 - sy) / this.scale + this.y; }

  pan(dx, dy) {
    this.x -= dx / this.scale; this.y += dy / this.scale;
    this.version += 1;
  }

  zoomAt(sx, sy, factor) {
    const x = this.wx(sx), y = this.wy(sy);
    this.scale = Math.min(400, Math.max(this.least, this.scale * factor));
    this.x = x - (sx - this.width / 2) / this.scale;
    this.y = y + (sy - this.height / 2) / this.scale;
    this.version += 1;
  }

  follow(x, y) {
    if (Math.abs(x - this.x) < 1e-9 && Math.abs(y - this.y) < 1e-9) return;
    this.x = x; this.y = y;
    this.version += 1;
  }
}
