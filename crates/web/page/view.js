// Canvases, and the platform in three dimensions as in reports: North to the right, Up upwards, East to the reader.
import { $ } from './dom.js';
import { LETTERS, RAD, matrixOf, times, turn, turnBetween } from './geometry.js';
import { anglesOfPosition, chosen, select, shown, state } from './scheme.js';

// functions that draw a canvas
const drawings = [];
/** Adds a function that draws a canvas again. */
export const onDraw = (draw) => drawings.push(draw);

// colours of the page by name; cleared when the preferred colour scheme changes
const palette = new Map();
export const clearColors = () => palette.clear();

export function color(name) {
  if (!palette.has(name)) palette.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return palette.get(name);
}

/** Drawing context and size in pixels of a canvas at the resolution of the screen. */
export function sheet(canvas) {
  const scale = window.devicePixelRatio || 1, [w, h] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(w * scale) || canvas.height !== Math.round(h * scale)) {
    canvas.width = Math.round(w * scale);
    canvas.height = Math.round(h * scale);
  }
  const c = canvas.getContext('2d');
  c.setTransform(scale, 0, 0, scale, 0, 0);
  c.clearRect(0, 0, w, h);
  c.font = '13px system-ui, sans-serif';
  return [c, w, h];
}

const look = { azimuth: 40 * RAD, elevation: 20 * RAD };
// attitude during a shown slew
let onTheWay = null;

/** Components of a vector to the right, downwards and towards the reader. */
function seen([n, u, e]) {
  const [sa, ca, sh, ch] = [Math.sin(look.azimuth), Math.cos(look.azimuth), Math.sin(look.elevation), Math.cos(look.elevation)];
  const near = n * sa + e * ca;
  return [n * ca - e * sa, -(u * ch - near * sh), u * sh + near * ch];
}

const GYROS = { X: { I: '+x', O: '-z', S: '+y' }, Y: { I: '+y', O: '-z', S: '-x' }, Z: { I: '+z', O: '+x', S: '+y' } };

/** Axis of the platform, such as `-x`, in n. */
function axisOf(c, text) {
  const j = 'xyz'.indexOf(text[1]);
  return c.map((row) => (text[0] === '-' ? -1 : 1) * row[j]);
}

/**
 * Draws the platform at an attitude (its axes as columns, in North, Up, East), on a canvas; without an attitude
 * the directions of the site alone. Returns the directions of the axes in words. `small` leaves out the gyros.
 */
export function drawPlatform(canvas, m, { small = false } = {}) {
  const [c, w, h] = sheet(canvas), unit = Math.min(w, h) * (small ? 0.27 : 0.3);
  const at = (v, k = 1) => { const [x, y] = seen(v); return [w / 2 + unit * k * x, h / 2 + unit * k * y]; };
  const line = (from, to, stroke, width, dash = []) => {
    c.beginPath(); c.moveTo(...from); c.lineTo(...to);
    c.strokeStyle = stroke; c.lineWidth = width; c.setLineDash(dash); c.stroke(); c.setLineDash([]);
  };
  const label = (text, v, k, fill, bold) => {
    c.font = `${bold ? 'bold ' : ''}13px system-ui, sans-serif`; c.fillStyle = fill; c.textAlign = 'center'; c.textBaseline = 'middle';
    const [x, y] = at(v, k), [ox, oy] = at([0, 0, 0]), length = Math.hypot(x - ox, y - oy) || 1;
    c.fillText(text, x + ((x - ox) / length) * 11 + (length < 8 ? 10 : 0), y + ((y - oy) / length) * 11);
  };
  const arrow = (v, stroke, width, k = 1, alpha = 1) => {
    const [from, to] = [at([0, 0, 0]), at(v, k)], [dx, dy] = [to[0] - from[0], to[1] - from[1]], length = Math.hypot(dx, dy);
    c.globalAlpha = alpha;
    if (length < 6) {
      c.beginPath(); c.arc(...to, 5, 0, 7); c.strokeStyle = stroke; c.lineWidth = width; c.stroke();
    } else {
      const [ux, uy] = [dx / length, dy / length], head = 4 + width * 1.7;
      line(from, [to[0] - ux * head, to[1] - uy * head], stroke, width, seen(v)[2] < -1e-9 && width < 4 ? [5, 4] : []);
      c.beginPath(); c.moveTo(...to);
      for (const s of [1, -1]) c.lineTo(to[0] - ux * head * 1.8 + s * uy * head * 0.8, to[1] - uy * head * 1.8 - s * ux * head * 0.8);
      c.closePath(); c.fillStyle = stroke; c.fill();
    }
    c.globalAlpha = 1;
  };
  for (const [name, v] of [['N', [1, 0, 0]], ['U', [0, 1, 0]], ['E', [0, 0, 1]]]) {
    line(at([0, 0, 0]), at(v, 1.4), color('grey'), 1);
    label(name, v, small ? 1.5 : 1.45, color('grey'));
  }
  const latitude = (state.scheme.latitude_deg ?? 28.2) * RAD, rate = [Math.cos(latitude), Math.sin(latitude), 0];
  arrow([0, -1, 0], color('black'), 5, 1.12, 0.5);
  arrow(rate, color('purple'), 5, 1.12, 0.5);
  if (!small) { label('g', [0, -1, 0], 1.12, color('black')); label('\u03c9', rate, 1.12, color('purple')); }
  if (!m) return '';
  const geometry = state.scheme.geometry ?? GYROS;
  const [x, y, z] = [0, 1, 2].map((j) => m.map((r) => r[j]));
  c.beginPath();
  [[1, 1], [1, -1], [-1, -1], [-1, 1]].forEach(([a, b]) => c.lineTo(...at(x.map((xi, i) => 0.42 * (a * xi + b * z[i])))));
  c.closePath(); c.globalAlpha = 0.18; c.fillStyle = color('grey'); c.fill(); c.globalAlpha = 1;
  c.strokeStyle = color('grey'); c.lineWidth = 1; c.stroke();
  [['X', x, 'blue'], ['Y', y, 'orange'], ['Z', z, 'green']].sort((a, b) => seen(a[1])[2] - seen(b[1])[2]).forEach(([name, v, hue]) => {
    arrow(v, color(hue), 2.4);
    label(small ? name : `${name}_p`, v, 1.04, color(hue), true);
    if (small) return;
    const gyro = geometry[name] ?? geometry[name.toLowerCase()] ?? GYROS[name];
    // a ring about the input axis of the gyro, a square for the accelerometer
    const input = axisOf(m, gyro.I ?? GYROS[name].I), [rx, ry] = at(input, 0.62), [qx, qy] = at(v, 0.82);
    c.lineWidth = 2; c.strokeStyle = color(hue); c.fillStyle = color('paper');
    c.beginPath(); c.arc(rx, ry, 6, 0, 7); c.fill(); c.stroke();
    c.fillRect(qx - 4, qy - 4, 8, 8); c.strokeRect(qx - 4, qy - 4, 8, 8);
    if ($('gyro-axes').checked) {
      for (const axis of ['O', 'S']) {
        const d = axisOf(m, gyro[axis] ?? GYROS[name][axis]), tip = input.map((xi, i) => 0.62 * xi + 0.26 * d[i]);
        line([rx, ry], at(tip), color(hue), 1.3, axis === 'S' ? [2, 2] : []);
        c.font = '11px system-ui, sans-serif'; c.fillStyle = color(hue); c.fillText(axis, ...at(input.map((xi, i) => 0.62 * xi + 0.33 * d[i])));
      }
    }
  });
  const words = (v) => {
    const name = Object.entries({ North: LETTERS.N, South: LETTERS.S, Up: LETTERS.U, Down: LETTERS.D, East: LETTERS.E, West: LETTERS.W })
      .find(([, d]) => d.every((xi, i) => Math.abs(xi - v[i]) < 1e-6));
    return name ? name[0] : `(${v.map((xi) => shown(Math.round(xi * 1000) / 1000)).join(', ')})`;
  };
  return `X_p points ${words(x)}, Y_p ${words(y)}, Z_p ${words(z)} in North, Up, East.`;
}

/** Draws the selected position. */
function drawView() {
  const canvas = $('view');
  if (!canvas.clientWidth) return;
  const p = chosen(), angles = p && anglesOfPosition(p);
  const text = drawPlatform(canvas, angles && (onTheWay ?? matrixOf(angles))) || (p ? 'These angles are names: they have no picture.' : '');
  if ($('view-caption').textContent !== text) {
    $('view-caption').textContent = text;
    canvas.setAttribute('aria-label', `The platform: ${text} Arrow keys turn the view.`);
  }
}

/** Shows the shortest slew from this position to the next. */
function showSlew() {
  const all = state.scheme.position, at = state.selected, next = (at + 1) % all.length;
  const [from, to] = [anglesOfPosition(all[at]), anglesOfPosition(all[next])];
  if (!from || !to) return;
  const start = matrixOf(from), way = turnBetween(start, matrixOf(to));
  const began = performance.now(), calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
  const lasts = calm ? 0 : 400 + 500 * way.angle;
  const step = (now) => {
    const part = lasts ? Math.min(1, Math.max(0, now - began) / lasts) : 1;
    onTheWay = part < 1 && state.selected === at ? times(turn(way.axis, way.angle * part), start) : null;
    if (onTheWay) { drawView(); requestAnimationFrame(step); } else if (state.selected === at) select(next);
  };
  requestAnimationFrame(step);
}

export function wireView() {
  onDraw(drawView);
  const canvas = $('view');
  let from = null;
  canvas.addEventListener('pointerdown', (e) => { from = [e.clientX, e.clientY, look.azimuth, look.elevation]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener('pointermove', (e) => {
    if (!from) return;
    turnLook(from[2] + (e.clientX - from[0]) * 0.008, from[3] + (e.clientY - from[1]) * 0.008);
  });
  for (const kind of ['pointerup', 'pointercancel']) canvas.addEventListener(kind, () => { from = null; });
  canvas.addEventListener('keydown', (e) => {
    const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
    if (!by) return;
    e.preventDefault();
    turnLook(look.azimuth + by[0], look.elevation + by[1]);
  });
  $('slew').addEventListener('click', showSlew);
  $('gyro-axes').addEventListener('change', drawView);
}

function turnLook(azimuth, elevation) {
  look.azimuth = azimuth;
  look.elevation = Math.max(-1.5, Math.min(1.5, elevation));
  canvasSoon();
}

let soon = false;
/** Draws all canvases at the next frame. */
export function canvasSoon() {
  if (soon) return;
  soon = true;
  requestAnimationFrame(() => { soon = false; drawings.forEach((draw) => draw()); });
}
