// The mask editor: draw an iris, white lets light through.
import { button, dialog, h, press } from './ui.js';

const SIDE = 512;
const SHAPES = {
  Circle: (pen) => pen.arc(SIDE / 2, SIDE / 2, SIDE * 0.46, 0, 7),
  Heart: (pen) => { const m = SIDE / 2; const u = SIDE * 0.46; pen.moveTo(m, m + u * 0.85); pen.bezierCurveTo(m - u * 1.5, m - u * 0.1, m - u * 0.7, m - u * 1.2, m, m - u * 0.45); pen.bezierCurveTo(m + u * 0.7, m - u * 1.2, m + u * 1.5, m - u * 0.1, m, m + u * 0.85); },
  Star: (pen) => { for (let k = 0; k < 10; k++) { const r = SIDE * (k % 2 ? 0.2 : 0.46); pen.lineTo(SIDE / 2 + r * Math.sin(k * Math.PI / 5), SIDE / 2 - r * Math.cos(k * Math.PI / 5)); } },
  Slit: (pen) => pen.rect(SIDE * 0.06, SIDE * 0.44, SIDE * 0.88, SIDE * 0.12),
};

// Starts with the present mask as in its file: the iris' rotation turns it in the lens, not in the editor.
export function drawMask(use, iris) {
  const canvas = h('canvas', { width: SIDE, height: SIDE, class: 'sheet', tabindex: 0, role: 'img', 'aria-label': 'The opening: draw with the pointer' });
  const pen = canvas.getContext('2d');
  let light = true;
  const size = h('input', { type: 'range', min: 4, max: 160, value: 40, 'aria-label': 'Width of the brush' });
  const clear = (colour) => { pen.fillStyle = colour; pen.fillRect(0, 0, SIDE, SIDE); };
  const stamp = (shape) => { pen.fillStyle = light ? '#fff' : '#000'; pen.beginPath(); shape(pen); pen.fill(); };
  clear('#000');
  if (iris.mask) {
    const before = new Image();
    // a mask of any aspect ratio spans the opening
    before.onload = () => { pen.drawImage(before, 0, 0, SIDE, SIDE); canvas.dataset.started = 'yes'; };
    before.src = `api/mask?n=${Date.now()}`;
  }
  let last = null;
  const place = (event) => { const box = canvas.getBoundingClientRect(); return [(event.clientX - box.left) * SIDE / box.width, (event.clientY - box.top) * SIDE / box.height]; };
  function draw(event) {
    const now = place(event);
    pen.strokeStyle = light ? '#fff' : '#000';
    pen.lineWidth = Number(size.value);
    pen.lineCap = 'round';
    pen.beginPath();
    pen.moveTo(...(last ?? now));
    pen.lineTo(now[0] + 0.01, now[1]);
    pen.stroke();
    last = now;
  }
  canvas.addEventListener('pointerdown', (event) => { canvas.setPointerCapture(event.pointerId); last = null; draw(event); });
  canvas.addEventListener('pointermove', (event) => { if (event.buttons) draw(event); });
  const both = [button('Open', () => brush(true), { id: 'mask-open', tip: 'The brush lets light through.' }), button('Block', () => brush(false), { id: 'mask-block', tip: 'The brush stops light.' })];
  function brush(value) { light = value; press(both[0], value); press(both[1], !value); }
  brush(true);
  const shapes = Object.entries(SHAPES).map(([name, shape]) => button(name, () => stamp(shape), { 'data-shape': name }));
  const box = dialog('Draw the iris', h('p', { class: 'quietly' }, 'Every ghost becomes an image of it, and the starburst its diffraction. The inscribed circle is the opening of the f-number.'),
    iris.mask && iris.rotation_deg ? h('p', { id: 'mask-turned' }, `In the lens this mask is rotated by ${Number(iris.rotation_deg.toFixed(1))}° (Rotation).`) : '', canvas,
    h('div', { class: 'buttons' }, ...both, size, h('span', { class: 'gap' }), button('All blocked', () => clear('#000')), button('All open', () => clear('#fff'))),
    h('div', { class: 'buttons' }, ...shapes, h('span', { class: 'gap' }), button('Cancel', () => box.close()),
      button('Use it', () => canvas.toBlob((blob) => { box.close(); use(new File([blob], 'drawn.png')); }, 'image/png'), { kind: 'main', id: 'mask-use' })));
}
