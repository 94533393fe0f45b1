// Small shapes: they are added to a path or to the context's own one.

function circle(path, x, y, radius) {
  path.moveTo(x + radius, y);
  path.arc(x, y, radius, 0, 2 * Math.PI);
}

function cross(path, x, y, arm) {
  path.moveTo(x - arm, y - arm); path.lineTo(x + arm, y + arm);
  path.moveTo(x - arm, y + arm); path.lineTo(x + arm, y - arm);
}

// A triangle on its tip, as tall as it is wide.
function drop(path, x, y, arm) {
  path.moveTo(x - arm, y - arm); path.lineTo(x + arm, y - arm); path.lineTo(x, y + arm);
  path.closePath();
}

function line(path, x1, y1, x2, y2) {
  path.moveTo(x1, y1);
  path.lineTo(x2, y2);
}

// A body with its nose in front: a disc, or a polygon whose corners are given for a radius of 1.
function robotOutline(path, x, y, yaw, radius, corners = null) {
  if (corners) return polygonOutline(path, x, y, yaw, radius, corners);
  const nose = radius * 1.75, cheek = 0.62;
  path.moveTo(x + nose * Math.cos(yaw), y - nose * Math.sin(yaw));
  path.lineTo(x + radius * Math.cos(yaw + cheek), y - radius * Math.sin(yaw + cheek));
  path.arc(x, y, radius, -(yaw + cheek), -(yaw - cheek), true);
  path.closePath();
}

function polygonOutline(path, x, y, yaw, radius, corners) {
  const c = radius * Math.cos(yaw), s = radius * Math.sin(yaw), bow = bowOf(corners);
  for (const part of [corners, [[bow - 0.2, -0.2], [bow + 0.3, 0], [bow - 0.2, 0.2]]]) {
    part.forEach(([ahead, left], i) => {
      const px = x + c * ahead - s * left, py = y - s * ahead - c * left;
      if (i) path.lineTo(px, py); else path.moveTo(px, py);
    });
    path.closePath();
  }
}

// How far a polygon around the origin reaches straight ahead.
function bowOf(corners) {
  for (let i = 0; i < corners.length; i++) {
    const [x1, y1] = corners[i], [x2, y2] = corners[(i + 1) % corners.length];
    if (y1 <= 0 && y2 > 0) return x1 - y1 * (x2 - x1) / (y2 - y1);
  }
  return 0;
}

function distanceToLine(px, py, x1, y1, x2, y2) {
  const dx = x2 - x1, dy = y2 - y1, length = dx * dx + dy * dy || 1;
  const share = Math.max(0, Math.min(1, ((px - x1) * dx + (py - y1) * dy) / length));
  return Math.hypot(px - x1 - share * dx, py - y1 - share * dy);
}
