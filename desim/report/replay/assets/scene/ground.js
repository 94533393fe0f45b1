// The ground: the explored map, each cell in the colour of the robot that discovered it.

const GLOW_DS = 40;  // a cell shines for so many tenths of a second after its discovery
const GLOW_STEPS = 8;
const MOST_PICTURES = 6;

class Ground {
  constructor(run, growth) {
    Object.assign(this, { run, growth });
    this.pictures = new Map();
  }

  // Cells change ten times a second.
  key(view) {
    const life = this.#life(view);
    return [Math.floor(10 * view.timeS + 1e-6), view.chosen, life && this.#age(life, view)].join();
  }

  // The merged map; with a selected robot its own one, over a breath of what the others know.
  draw(context, camera, view) {
    const { growth } = this, life = this.#life(view);
    const merged = this.#picture("merged", growth.merged, false, view.theme);
    merged.paint(Math.floor(10 * view.timeS + 1e-6));
    drawMap(context, camera, growth.about, merged, view.chosen < 0 ? 1 : 0.22);
    if (!life) return;
    const picture = this.#picture(`life ${life.key}`, life.map, true, view.theme);
    picture.paint(this.#age(life, view));
    drawMap(context, camera, growth.about, picture);
  }

  #life(view) {
    return view.chosen < 0 ? null : this.growth.ofRobot(view.chosen, view.timeS);
  }

  // Tenths of a second since a robot's life began.
  #age(life, view) {
    return Math.floor(10 * (view.timeS - life.fromS) + 1e-6);
  }

  #picture(name, map, coarse, theme) {
    const key = `${theme.name} ${name}`;
    if (!this.pictures.has(key)) {
      if (this.pictures.size > MOST_PICTURES) this.pictures.clear();
      this.pictures.set(key, new MapPicture(this.growth, map, coarse, theme, this.run.robots.length));
    }
    return this.pictures.get(key);
  }
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

// The picture of one map in one theme: a pixel for each cell, painted up to an instant.
class MapPicture {
  constructor(growth, map, coarse, theme, robots) {
    this.growth = growth;
    this.map = map;
    const { about } = growth;
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
    const robot = this.growth.first[this.#fine(column, row, cell)];
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
    const { about } = this.growth, half = this.factor >> 1;
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
      const free = mixed(theme.free, colour, share);
      const solid = mixed(theme.solid, colour, 0.25);
      [free, solid].forEach(([r, g, b], state) => {
        table[2 * (robot * (GLOW_STEPS + 1) + glow) + state] =
          (255 << 24 | b << 16 | g << 8 | r) >>> 0;
      });
    }
  }
  return table;
}
