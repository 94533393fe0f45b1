// Small shapes: they are added to a path or to the context's own one.

function circle(path, x, y, radius) {
  path.moveTo(x + radius, y);
  path.arc(x, y, radius, 0, 2 * Math.PI);
}

function cross(path, x, y, arm) {
  path.moveTo(x - arm, y - arm); path.lineTo(x + arm, y + arm);
  path.moveTo(x - arm, y + arm); path.lineTo(x + arm, y - arm);
}

function line(path, x1, y1, x2, y2) {
  path.moveTo(x1, y1);
  path.lineTo(x2, y2);
}

// A disc with its nose in front.
function robotOutline(path, x, y, yaw, radius) {
  const nose = radius * 1.75, cheek = 0.62;
  path.moveTo(x + nose * Math.cos(yaw), y - nose * Math.sin(yaw));
  path.lineTo(x + radius * Math.cos(yaw + cheek), y - radius * Math.sin(yaw + cheek));
  path.arc(x, y, radius, -(yaw + cheek), -(yaw - cheek), true);
  path.closePath();
}

function distanceToLine(px, py, x1, y1, x2, y2) {
  const dx = x2 - x1, dy = y2 - y1, length = dx * dx + dy * dy || 1;
  const share = Math.max(0, Math.min(1, ((px - x1) * dx + (py - y1) * dy) / length));
  return Math.hypot(px - x1 - share * dx, py - y1 - share * dy);
}
