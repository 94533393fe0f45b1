// Colours. Those of robots are Okabe and Ito's and Paul Tol's, which colour-blind people tell apart;
// fleets are larger than any palette, so each robot has its number beside it, too.

const ROBOT_HUES = {
  light: ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#4a3aa7", "#56b4e9", "#8f8b1e", "#882255",
    "#2a9d97"],
  dark: ["#3d9fdc", "#f0b13a", "#2cc295", "#e29bc3", "#9a8df0", "#8ccff7", "#c9c44b", "#d8659b",
    "#55cfc4"],
};

const THEMES = {
  light: {
    name: "light", paper: "#fbfaf7", ink: "#1c2127", soft: "#6b727c", faint: "#a9adb3",
    rule: "#e2dfd7", unknown: "#e9e6de", shadow: "rgba(28,33,39,0.13)",
    wall: "#3a3f47", accent: "#0b5cad", alarm: "#c8401c", halo: "#fffefb", tint: 0.3, glow: 0.85,
    tintBase: [255, 254, 251], solidBase: [52, 57, 65], trail: 0.9,
    fan: 0.06, lit: "rgba(255,255,255,0.26)",
    split: "rgba(200,64,28,0.10)",
    materials: { concrete: "#3f444c", brick: "#a35a3f", glass: "#6aaed0", metal: "#5b6f84",
      plasterboard: "#8f8b83", stone: "#5a544d", wood: "#a87a3d" },
    kinds: ["#0b5cad", "#8a5a9e", "#7c8794"],
  },
  dark: {
    name: "dark", paper: "#121519", ink: "#e8eaed", soft: "#98a1ac", faint: "#5f6873",
    rule: "#2a3037", unknown: "#191d22", shadow: "rgba(0,0,0,0.42)",
    wall: "#c9ced6", accent: "#7cb8f5", alarm: "#ff7f50", halo: "#121519", tint: 0.3, glow: 0.8,
    tintBase: [38, 45, 53], solidBase: [190, 196, 204], trail: 0.95, fan: 0.07,
    lit: "rgba(255,255,255,0.075)",
    split: "rgba(255,127,80,0.14)",
    materials: { concrete: "#c3c9d1", brick: "#d08a6c", glass: "#8fd0f5", metal: "#93a9c1",
      plasterboard: "#a8a49b", stone: "#a89f94", wood: "#d3a463" },
    kinds: ["#7cb8f5", "#c79bdc", "#8b97a5"],
  },
};

const KINDS = ["coordination", "monitoring", "sensors and commands"];
// Signs that every common font has.
const EVENT_GLYPHS = { collision: "×", recovery: "↻", partition: "∥", host_stopped: "▼",
  host_started: "▲", late: "◆", saturation: "■", stop: "□", difference: "≠" };
const BAD = new Set(["collision", "host_stopped", "late", "saturation", "partition"]);

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
  const hues = ROBOT_HUES[theme.name];
  return hues[robot % hues.length];
}

// The short name of a host: robot_12 is 12.
function shortName(name) {
  const found = /^robot_(\d+)$/.exec(name);
  return found ? found[1] : name;
}
