// The colours of theme.css for canvases, and the signs and names of what is drawn in them.

const HUES = 9;  // of robots and topics
const KINDS = ["coordination", "monitoring", "sensors and commands", "other"];
// Signs that every common font has.
const EVENT_GLYPHS = { collision: "×", recovery: "↻", partition: "∥", host_stopped: "▼",
  host_started: "▲", late: "◆", saturation: "■", stop: "□", difference: "≠",
  out_of_memory: "●", missed_ticks: "○" };
const BAD = new Set(["collision", "host_stopped", "late", "saturation", "partition",
  "out_of_memory", "missed_ticks"]);

// Put a theme ("light" or "dark") on the page and read it.
function themeOfPage(name) {
  document.documentElement.dataset.theme = name;
  const style = getComputedStyle(document.documentElement);
  const value = (key) => style.getPropertyValue(`--${key}`).trim();
  const values = (keys) => Object.fromEntries(keys.map((key) => [key, value(key)]));
  return {
    name,
    ...values(["sans", "paper", "ink", "soft", "faint", "rule", "unknown", "accent", "alarm", "halo",
      "wall", "shadow", "lit", "split"]),
    free: rgb(value("free")), solid: rgb(value("solid")),
    tint: Number(value("tint")), glow: Number(value("glow")), trail: Number(value("trail")),
    fan: Number(value("fan")),
    hues: Array.from({ length: HUES }, (_, k) => value(`hue-${k}`)),
    kinds: KINDS.map((_, k) => value(`kind-${k}`)),
    material: (material) => value(`material-${material}`) || value("wall"),
  };
}

function rgb(hex) {
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
}

function mixed(base, colour, share) {
  return base.map((value, k) => Math.round(value + share * (colour[k] - value)));
}

function alpha(hex, share) {
  const [r, g, b] = rgb(hex);
  return `rgba(${r},${g},${b},${share})`;
}

function robotColour(theme, robot) {
  return theme.hues[robot % HUES];
}
