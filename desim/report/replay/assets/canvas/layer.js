// Canvases: drawings that are kept while nothing in them changes, and sizes.

// A canvas that keeps a drawing until the view, its size or something else changes.
class Layer {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.key = null;
  }

  // Make it as large as the view; `draw` is called where the key is a new one. Whether it was.
  kept(camera, ratio, key, draw) {
    const full = `${key}|${camera.version}|${camera.width}|${camera.height}|${ratio}`;
    if (full === this.key) return false;
    const context = sized(this.canvas, camera.width, camera.height, ratio);
    context.clearRect(0, 0, camera.width, camera.height);
    draw(context);
    this.key = full;
    return true;
  }

  show(context, camera) {
    context.drawImage(this.canvas, 0, 0, camera.width, camera.height);
  }
}

// Drawings on top of each other, a canvas each, which the browser puts together: one that does not
// change costs little (300 robots without a graphics card: 37 ms of processor a frame as one canvas,
// 22 ms as sheets).
class Sheets {
  constructor(element, count) {
    this.layers = Array.from({ length: count }, () => new Layer());
    for (const { canvas } of this.layers) {
      canvas.setAttribute("aria-hidden", "true");
      element.append(canvas);
    }
  }

  // Draw lists of drawings, one on each sheet. A drawing is drawn anew in each frame; one with a
  // `key` only when that changes, and with all on its sheet; between, it may `grow`.
  draw(lists, camera, view) {
    lists.forEach((drawings, k) => {
      const layer = this.layers[k], context = layer.canvas.getContext("2d");
      const keys = drawings.map((drawing) => drawing.key ? drawing.key(view) : null);
      const key = keys.includes(null) ? this.frames = (this.frames ?? 0) + 1 : keys.join("|");
      const isNew = layer.kept(camera, view.ratio, `${view.theme.name} ${view.version} ${key}`, () => {
        for (const drawing of drawings) drawing.draw(context, camera, view);
      });
      if (!isNew) for (const drawing of drawings) drawing.grow?.(context, camera, view);
    });
  }
}

// Give a canvas so many pixels of the page, if it has not; its unit is such a pixel.
function sized(canvas, width, height, ratio) {
  const wide = Math.max(1, Math.round(width * ratio)), high = Math.max(1, Math.round(height * ratio));
  if (canvas.width !== wide || canvas.height !== high) {
    canvas.width = wide;
    canvas.height = high;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

// The size of an element in pixels of the page, measured when it changes: to measure in each frame
// makes the browser lay the page out each time (2 ms of 22 at 300 robots).
class Extent {
  constructor(element, changed) {
    this.element = element;
    this.width = this.height = this.version = 0;
    new ResizeObserver(() => { this.#measure(); changed(); }).observe(element);
  }

  // This size; an element that was not in the page when it was measured is measured again.
  now() {
    if (!this.width) this.#measure();
    return this;
  }

  #measure() {
    const { width, height } = this.element.getBoundingClientRect();
    if (width === this.width && height === this.height) return;
    Object.assign(this, { width, height, version: this.version + 1 });
  }
}
