// The scale bar, in the lower left corner.

const BAR_LENGTHS_M = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const BAR_PX = 90;  // at most

class ScaleBar {
  draw(context, camera, { theme, labels, ratio }) {
    const metres = BAR_LENGTHS_M.findLast((length) => length <= BAR_PX / camera.scale)
      ?? BAR_LENGTHS_M[0];
    const wide = metres * camera.scale, x = 16, y = camera.height - 16;
    context.save();
    context.strokeStyle = theme.soft;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y - 4); context.lineTo(x, y); context.lineTo(x + wide, y);
    context.lineTo(x + wide, y - 4);
    context.stroke();
    putLabel(context, labels.of(`${metres} m`, { font: `11px ${theme.sans}`, lineHeight: 14,
      colour: theme.soft, halo: theme.unknown, ratio }), x + 5, y - 10);
    context.restore();
  }
}
