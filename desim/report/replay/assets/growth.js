// Maps that grow: a picture with a pixel for each cell, painted up to an instant.

const NEVER = 65535;
const GLOW_DS = 40;  // a cell shines for so many tenths of a second after its discovery
const GLOW_STEPS = 8;

// Who discovered each cell, and when; each robot's own map.
class Knowledge {
  constructor(run) {
    const { about, columns } = run.growing[0];
    this.about = about;
    this.columns = columns;
    this.first = columns.values("merged.robot");
    this.merged = this.#map("merged");
    this.lives = new Map();
  }

  // The cells of a map in the order in which they became known.
  #map(name) {
    const is = this.columns.values(`${name}.known.is`);
    const held = this.columns.values(`${name}.known`);
    const known = new Uint16Array(held.length);
    let last = 0;
    for (let i = 0; i < held.length; i++) {
      known[i] = is[i] ? held[i] : NEVER;
      if (is[i] && held[i] > last) last = held[i];
    }
    const starts = new Int32Array(last + 3);
    for (let i = 0; i < known.length; i++) if (is[i]) starts[known[i] + 1] += 1;
    for (let ds = 1; ds < starts.length; ds++) starts[ds] += starts[ds - 1];
    const order = new Int32Array(starts[last + 1]), at = starts.slice();
    for (let i = 0; i < known.length; i++) if (is[i]) order[at[known[i]]++] = i;
    return { known, order, starts, last, occupied: this.columns.values(`${name}.occupied`) };
  }

  // The map of the robot's life that runs at the time, and when the life began; null: none.
  ofRobot(robot, timeS) {
    const lives = this.about.lives;
    for (let k = lives.length - 1; k >= 0; k--) {
      if (lives[k].robot !== robot || lives[k].from_ns > timeS * NS + 1) continue;
      if (!this.lives.has(k)) this.lives.set(k, this.#map(`growth.${k}`));
      return { map: this.lives.get(k), fromS: lives[k].from_ns / NS, key: k };
    }
    return null;
  }
}

// The number of cells that a map has by a tenth of a second.
function cellsBy(map, ds) {
  if (ds < 0) return 0;
  return map.starts[Math.min(ds, map.last) + 1];
}

// The picture of one map in one theme.
class MapPicture {
  constructor(knowledge, map, coarse, theme, robots) {
    this.knowledge = knowledge;
    this.map = map;
    const about = knowledge.about;
    [this.width, this.height] = coarse ? about.coarse : [about.width, about.height];
    this.factor = coarse ? about.factor : 1;
    this.canvas = document.createElement("canvas");
    this.canvas.width = this.width;
    this.canvas.height = this.height;
    this.context = this.canvas.getContext("2d");
    this.image = this.context.createImageData(this.width, this.height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.colours = colourTable(theme, robots);
    this.painted = 0;
    this.settled = 0;  // cells before this one do not shine any more
    this.ds = -1;
  }

  // Paint the map as of a tenth of a second.
  paint(ds) {
    if (ds === this.ds) return this.canvas;
    const count = cellsBy(this.map, ds), dim = cellsBy(this.map, ds - GLOW_DS);
    if (count < this.painted || dim < this.settled) {
      this.pixels.fill(0);
      this.settled = 0;
    }
    const whole = this.settled === 0;
    this.box = [this.width, this.height, 0, 0];
    for (let k = this.settled; k < count; k++) this.#cell(this.map.order[k], ds);
    const [left, top, right, bottom] = whole ? [0, 0, this.width, this.height] : this.box;
    if (right > left) {
      this.context.putImageData(this.image, 0, 0, left, top, right - left, bottom - top);
    }
    this.painted = count;
    this.settled = dim;
    this.ds = ds;
    return this.canvas;
  }

  #cell(cell, ds) {
    const column = cell % this.width, row = (cell - column) / this.width;
    const age = ds - this.map.known[cell];
    const glow = age >= GLOW_DS ? 0 : GLOW_STEPS - Math.floor(age * GLOW_STEPS / GLOW_DS);
    const robot = this.knowledge.first[this.#fine(column, row, cell)];
    const shade = 2 * (robot * (GLOW_STEPS + 1) + glow) + this.map.occupied[cell];
    const line = this.height - 1 - row, box = this.box;
    this.pixels[line * this.width + column] = this.colours[shade];
    if (column < box[0]) box[0] = column;
    if (line < box[1]) box[1] = line;
    if (column >= box[2]) box[2] = column + 1;
    if (line >= box[3]) box[3] = line + 1;
  }

  // The cell of the merged map under a cell of this one.
  #fine(column, row, cell) {
    if (this.factor === 1) return cell;
    const about = this.knowledge.about, half = this.factor >> 1;
    return Math.min(about.height - 1, row * this.factor + half) * about.width
      + Math.min(about.width - 1, column * this.factor + half);
  }
}

// ABGR of every robot, glow and state (free, occupied).
function colourTable(theme, robots) {
  const table = new Uint32Array(2 * robots * (GLOW_STEPS + 1));
  for (let robot = 0; robot < robots; robot++) {
    const colour = rgb(robotColour(theme, robot));
    for (let glow = 0; glow <= GLOW_STEPS; glow++) {
      const share = theme.tint + (theme.glow - theme.tint) * (glow / GLOW_STEPS) ** 2;
      const free = mixed(theme.tintBase, colour, share);
      const solid = mixed(theme.solidBase, colour, 0.25);
      [free, solid].forEach(([r, g, b], state) => {
        table[2 * (robot * (GLOW_STEPS + 1) + glow) + state] =
          (255 << 24 | b << 16 | g << 8 | r) >>> 0;
      });
    }
  }
  return table;
}

// Draw a map's picture where its cells are.
function drawMap(context, camera, about, picture, opacity = 1) {
  const size = about.resolution_m * picture.factor;
  const width = picture.width * size * camera.scale, height = picture.height * size * camera.scale;
  context.save();
  context.globalAlpha = opacity;
  context.imageSmoothingEnabled = camera.scale * size < 5;
  context.imageSmoothingQuality = "high";
  context.drawImage(picture.canvas, camera.sx(about.x_m),
    camera.sy(about.y_m + picture.height * size), width, height);
  context.restore();
}
