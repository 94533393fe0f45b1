// Words on a canvas with a rim of the paper's colour: each is drawn once, then copied.

const RIM_PX = 3;
const LINE_PX = 10, GAP_PX = 3;  // between the lines of two labels, and beside each other
const MOST_LABELS = 2000;

class Labels {
  constructor() {
    this.pictures = new Map();
    this.pen = new OffscreenCanvas(1, 1).getContext("2d");
  }

  // The picture of a word and its size in pixels of the page. `style`: font (CSS), lineHeight (px),
  // colour, halo, ratio.
  of(text, style) {
    const key = `${style.font} ${style.colour} ${style.ratio} ${text}`;
    let label = this.pictures.get(key);
    if (!label) {
      if (this.pictures.size > MOST_LABELS) this.pictures.clear();
      this.pictures.set(key, label = this.#made(text, style));
    }
    return label;
  }

  #made(text, { font, lineHeight, colour, halo, ratio }) {
    this.pen.font = font;
    const wide = this.pen.measureText(text).width;
    const width = Math.ceil(wide + 2 * RIM_PX), height = lineHeight + 2 * RIM_PX;
    const canvas = new OffscreenCanvas(Math.ceil(width * ratio), Math.ceil(height * ratio));
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    Object.assign(context, { font, textBaseline: "middle", lineJoin: "round", lineWidth: RIM_PX,
      strokeStyle: halo, fillStyle: colour });
    context.strokeText(text, RIM_PX, height / 2);
    context.fillText(text, RIM_PX, height / 2);
    return { image: canvas.transferToImageBitmap(), wide, ratio };
  }
}

// Put a label at the first of the places (x of its left end) at which it covers none of those that
// were put before it; whether there was one.
function putWhereFree(context, taken, label, places, y) {
  const { wide } = label;
  const x = places.find((left) => isFree(taken, left, wide, y));
  if (x === undefined) return false;
  taken.push({ from: x, until: x + wide, y });
  putLabel(context, label, x, y);
  return true;
}

function isFree(taken, left, wide, y) {
  return taken.every((one) => left > one.until + GAP_PX || left + wide < one.from - GAP_PX
    || Math.abs(one.y - y) > LINE_PX);
}

// Draw a label with its left end at x and its middle at y, on whole pixels of the screen.
function putLabel(context, { image, ratio }, x, y) {
  const width = image.width / ratio, height = image.height / ratio;
  context.drawImage(image, Math.round((x - RIM_PX) * ratio) / ratio,
    Math.round((y - height / 2) * ratio) / ratio, width, height);
}
