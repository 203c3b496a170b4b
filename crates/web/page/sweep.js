// Questions in the background: what each position is needed for, verdicts along the sliders with marks and a strip.
import { $, element, put, two } from './dom.js';
import { behind } from './engine.js';
import { AXES, withinTurn } from './geometry.js';
import { failed } from './notice.js';
import { setAngle } from './positions.js';
import { anglesOfPosition, chosen, copy, endGesture, nameOfPosition, shown, source, state } from './scheme.js';
import { byName, verdicts } from './verdicts.js';
import { color, onDraw, sheet } from './view.js';

/** Unknowns that need a position: not observable without it (`lost`), or of a higher degree (`later`). */
async function without(at) {
  const scheme = copy(state.scheme);
  scheme.position.splice(at, 1);
  const said = await behind.ask('call', ['analyze', { sources: [source(scheme)], solutions: false, omitted: false }], { topic: `sweep without ${at}` }).catch(failed);
  if (!said?.text || !verdicts.now) return null;
  const less = byName(JSON.parse(said.text)), lost = [], later = [];
  for (const q of verdicts.now.answer.quantities) {
    const other = less.get(q.name);
    if (!other || q.degree === null) continue;
    if (other.degree === null) lost.push(q.name);
    else if (other.degree > q.degree) later.push(`${q.name} ${q.degree} to ${other.degree}`);
  }
  return { lost, later };
}

/** Judges the scheme without each position, the selected one first. */
async function dropOne() {
  const all = state.scheme.position ?? [], asked = JSON.stringify(state.scheme), at = state.selected;
  if (all.length < 2 || all.length > 60) { put($('drop-one'), ''); return drawNeeds(null); }
  await verdicts.answered;
  const needs = needed.of === asked ? needed.by : [];
  const others = all.length > 24 ? [] : all.map((_, i) => i).filter((i) => i !== at);
  for (const i of [at, ...others]) {
    needs[i] ??= await without(i);
    if (asked !== JSON.stringify(state.scheme) || !needs[i]) return;
    if (i !== at) continue;
    const { lost, later } = needs[i];
    const parts = [...(lost.length ? [`${lost.join(', ')} would not be observable`] : []), ...(later.length ? [`degrees rise: ${later.join(', ')}`] : [])];
    put($('drop-one'), `Without ${nameOfPosition(all[i], i)}: ${parts.join('; ') || 'the same verdicts'}.`);
  }
  needed.of = asked;
  needed.by = needs;
  drawNeeds(needs);
}

// need of each position, and the scheme that it is of
const needed = { of: null, by: [] };

function drawNeeds(needs) {
  [...$('positions').children].forEach((li, i) => {
    const n = needs?.[i];
    put(li.querySelector('.need'), !n ? '' : n.lost.length ? `needed for ${n.lost.length}` : n.later.length ? `degree lower for ${n.later.length}` : 'not needed');
  });
}

/** Removes the need of each position if it is of another scheme. */
export function clearNeeds() {
  put($('drop-one'), '\u00a0');
  if (needed.of !== JSON.stringify(state.scheme)) drawNeeds(null);
}

// degrees and sigmas along a slider, by the scheme without that angle
const sweeps = new Map();
// sweeps of schemes with more positions would take too long
const MANY = 30;
// unknown whose sigma the strip shows
let shownSigma = null;
const GRID = Array.from({ length: 73 }, (_, i) => i * 5 - 180);

function sweepKey(axis) {
  const s = copy(state.scheme), p = s.position[state.selected];
  const angles = anglesOfPosition(p);
  if (!angles) return null;
  delete p.attitude;
  p.angles_deg = angles.map((x, k) => (k === axis ? null : x));
  return JSON.stringify([state.selected, s]);
}

/**
 * Angles tried along a slider: multiples of 5, the other positions' angles, mirror images, quarter turns of
 * both.
 */
function anglesToTry(axis) {
  const wrapped = (angle) => +(((angle + 540) % 360) - 180).toFixed(9);
  const others = state.scheme.position.filter((_, i) => i !== state.selected).map((p) => anglesOfPosition(p)?.[axis] ?? 0);
  const more = others.flatMap((angle) => [0, 90, 180, 270].flatMap((turn) => [wrapped(turn + angle), wrapped(turn - angle)])).filter((angle) => angle % 5 !== 0);
  return [...GRID, ...new Set(more)];
}

const degreesOf = (said) => Object.fromEntries(JSON.parse(said.text).quantities.map((q) => [q.name, q.degree]));

async function sweep(axis, mine) {
  const key = sweepKey(axis);
  if (!key || state.scheme.position.length > MANY) return;
  if (!sweeps.has(key)) {
    if (sweeps.size > 60) sweeps.clear();
    const grid = anglesToTry(axis);
    sweeps.set(key, { grid, degrees: Array(grid.length).fill(null), sigmas: Array(GRID.length).fill(null) });
  }
  const found = sweeps.get(key), at = state.selected, angles = anglesOfPosition(chosen());
  const texts = found.grid.map((angle) => {
    const s = copy(state.scheme);
    delete s.position[at].attitude;
    s.position[at].angles_deg = angles.map((x, k) => (k === axis ? angle : x));
    return source(s);
  });
  const fresh = () => mine === round && sweepKey(axis) === key;
  for (let i = 0; i < found.grid.length; i++) {
    if (found.degrees[i]) continue;
    const said = await behind.ask('call', ['analyze', { sources: [texts[i]], solutions: false, omitted: false }], { topic: `sweep ${axis} ${i}` }).catch(() => null);
    if (!fresh()) return;
    if (!said?.text) return;
    found.degrees[i] = degreesOf(said);
    if (i % 12 === 0) drawSweep(axis);
  }
  drawSweep(axis);
  if (axis !== state.axis) return;
  for (let i = 0; i < GRID.length; i++) {
    if (found.sigmas[i]) continue;
    const said = await behind.ask('call', ['simulate', { sources: [texts[i]] }], { topic: `sweep ${axis} ${i}` }).catch(() => null);
    if (!fresh()) return;
    if (!said?.text) return;
    found.sigmas[i] = Object.fromEntries(JSON.parse(said.text).quantities.map((q) => [q.name, [q.predicted_sigma, q.required_sigma]]));
    if (i % 6 === 0) drawStrip();
  }
  drawStrip();
}

// number of the current sweep; a sweep of a lower number ends
let round = 0;
/** Ends the sweep in the background, so that the verdicts have the machine. */
export function endSweep() { round++; }

/** Sweeps all angles of the sliders in the background, the slider in use first. */
export async function askBehind() {
  const mine = ++round;
  behind.forget('sweep');
  for (const k of [0, 1, 2]) drawMarks(k);
  mark('latitude', LATITUDES, null);
  if (!chosen()) return;
  await dropOne();
  for (const axis of [state.axis, ...[0, 1, 2].filter((k) => k !== state.axis)]) {
    if (mine !== round) return;
    await sweep(axis, mine);
  }
  if (mine === round) await sweepLatitudes(mine);
}

function drawSweep(axis) {
  drawMarks(axis);
  if (axis === state.axis) drawStrip();
}

const signature = (degrees) => Object.values(degrees).map((d) => d ?? '-').join(' ');
const ranked = (degrees) => Object.values(degrees).filter((d) => d !== null).length;

/** Marks the angles whose verdict differs from the most frequent one. */
function drawMarks(axis) {
  const key = chosen() && sweepKey(axis), found = key && sweeps.get(key);
  mark(AXES[axis], found?.grid ?? GRID, found?.degrees);
}

function mark(slider, grid, degrees) {
  const box = $(`${slider}-marks`), from = grid[0], range = -2 * from;
  $(slider).title = '';
  if (!degrees || degrees.some((d) => !d)) return box.replaceChildren();
  const counts = new Map();
  degrees.forEach((d) => counts.set(signature(d), (counts.get(signature(d)) ?? 0) + 1));
  const common = [...counts].sort((a, b) => b[1] - a[1])[0][0];
  const usual = ranked(degrees.find((d) => signature(d) === common));
  const other = grid.map((angle, i) => [angle, degrees[i]]).filter(([, d]) => signature(d) !== common).sort(([a], [b]) => a - b);
  box.replaceChildren(...other.map(([angle, d]) => {
    const line = element('i', { title: `${angle}\u00b0`, className: ranked(d) > usual ? 'better' : '' });
    line.style.left = `${((angle - from) / range) * 100}%`;
    return line;
  }));
  const at = other.map(([angle]) => angle).join(', ');
  const tried = `tried: multiples of 5${grid.length > GRID.length ? ' and the angles of other positions, their mirror images and quarter turns from both' : ''}`;
  $(slider).title = at ? `Other verdicts at ${at} deg (${tried})` : `The same verdicts at all angles (${tried})`;
}

const LATITUDES = GRID.filter((angle) => Math.abs(angle) <= 90);

/** Finds the latitudes whose verdict differs from the most frequent one. */
async function sweepLatitudes(mine) {
  if (state.scheme.position.length > MANY) return;
  const keyNow = () => JSON.stringify({ ...state.scheme, latitude_deg: null }), key = keyNow();
  if (!sweeps.has(key)) sweeps.set(key, Array(LATITUDES.length).fill(null));
  const degrees = sweeps.get(key), rest = copy(state.scheme);
  for (const [i, angle] of LATITUDES.entries()) {
    if (degrees[i]) continue;
    const at = source({ ...rest, latitude_deg: angle });
    const said = await behind.ask('call', ['analyze', { sources: [at], solutions: false, omitted: false }], { topic: `sweep latitude ${i}` }).catch(() => null);
    if (mine !== round || key !== keyNow() || !said?.text) return;
    degrees[i] = degreesOf(said);
  }
  mark('latitude', LATITUDES, degrees);
}

/** Offers the unknowns whose sigma the strip can show. */
export function offerStrip(answer) {
  const box = $('strip-of'), known = byName(answer), names = answer.unknowns.filter((n) => known.has(n));
  if (box.dataset.of === names.join()) return;
  box.dataset.of = names.join();
  box.replaceChildren(...names.map((n) => element('option', { textContent: n })));
  box.value = names.includes(shownSigma) ? shownSigma : names.includes('psi_y') ? 'psi_y' : names[0];
  shownSigma = box.value;
}

/** Draws the degrees of all unknowns along the slider, a row of cells each, and the sigma of one unknown. */
function drawStrip() {
  const canvas = $('strip');
  if (!canvas.clientWidth) return;
  const names = verdicts.now?.answer.unknowns ?? [], cells = names.length > 20 ? 6 : 11, left = 52, top = 2, low = 44, foot = 14;
  const p = chosen(), key = p && sweepKey(state.axis), many = state.scheme.position.length > MANY;
  const tall = key && !many ? `${top + cells * names.length + low + foot}px` : '0px';
  if (canvas.style.height !== tall) canvas.style.height = tall;
  const [c, w, h] = sheet(canvas), found = key && sweeps.get(key);
  if (!found) {
    return put($('strip-caption'), !p ? '' : many ? `No strip of more than ${MANY} positions.`
      : key ? 'The strip appears when the hand rests.' : 'Angles by name have no strip.');
  }
  const x = (i) => left + ((w - left - 4) * i) / GRID.length, step = (w - left - 4) / GRID.length;
  const tones = [color('green'), color('blue'), color('orange'), color('purple')];
  found.degrees.slice(0, GRID.length).forEach((d, i) => d && names.forEach((n, j) => {
    const degree = d[n];
    c.fillStyle = degree === null || degree === undefined ? color('shade') : tones[Math.min(3, degree)];
    c.fillRect(x(i), top + j * cells, step + 0.5, cells - 0.6);
  }));
  c.font = '10px system-ui, sans-serif'; c.fillStyle = color('soft'); c.textBaseline = 'middle';
  names.forEach((n, j) => {
    if (cells < 10 && n !== shownSigma) return;
    c.font = `${n === shownSigma ? 'bold ' : ''}10px system-ui, sans-serif`;
    c.fillText(n, 0, top + (j + 0.5) * cells);
  });
  c.font = '10px system-ui, sans-serif'; c.textAlign = 'center';
  for (const angle of [-180, -90, 0, 90, 180]) c.fillText(shown(angle), Math.min(x((angle + 180) / 5) + step / 2, w - 10), h - 5);
  c.textAlign = 'left';
  const values = found.sigmas.map((s) => s?.[shownSigma]?.[0]), known = values.filter((v) => v > 0).map(Math.log10);
  if (known.length) {
    const [min, max] = [Math.min(...known), Math.max(...known)], span = Math.max(max - min, 0.3);
    c.beginPath(); c.strokeStyle = color('text'); c.lineWidth = 1.4;
    values.forEach((v, i) => { if (v > 0) c.lineTo(x(i) + step / 2, h - foot - 6 - ((Math.log10(v) - min) / span) * (low - 14)); });
    c.stroke();
    c.fillStyle = color('soft');
    c.fillText(two(10 ** max), 0, h - foot - low + 9);
    c.fillText(two(10 ** min), 0, h - foot - 6);
  }
  const angles = anglesOfPosition(p), here = x((withinTurn(angles[state.axis]) + 180) / 5) + step / 2;
  c.strokeStyle = color('text'); c.lineWidth = 1.5; c.strokeRect(here - step / 2 - 0.5, 1, step + 1, h - foot - 2);
  const range = known.length ? ` Below, sigma of ${shownSigma}: ${two(10 ** Math.min(...known))} to ${two(10 ** Math.max(...known))} ${verdicts.sigmas?.get(shownSigma)?.unit ?? ''}.` : '';
  const highest = Math.max(0, ...found.degrees.flatMap((d) => (d ? Object.values(d) : [])).map((d) => d ?? 0));
  const kinds = [...[0, 1, 2, 3].slice(0, highest + 1).map((d) => [`d${d}`, d === 3 ? 'more' : String(d)]), ['', 'none']];
  const text = `Degree along ${AXES[state.axis]}:${kinds.map(([, word]) => word).join('')}.${range}`;
  if ($('strip-caption').textContent !== text) {
    const legend = kinds.flatMap(([kind, word]) => [element('i', { className: `swatch ${kind}` }), word]);
    $('strip-caption').replaceChildren(`Degree along ${AXES[state.axis]}:`, ...legend, `.${range}`);
    canvas.setAttribute('aria-label', `${text} Click or arrow keys choose an angle.`);
  }
}

export function wireStrip() {
  const canvas = $('strip');
  onDraw(drawStrip);
  AXES.forEach((axis, k) => $(axis).addEventListener('focus', () => { state.axis = k; drawStrip(); }));
  const go = (angle) => setAngle(state.axis, Math.max(-180, Math.min(180, angle)), `strip ${state.selected} ${state.axis}`);
  const at = (e) => {
    const box = canvas.getBoundingClientRect();
    go(GRID[Math.max(0, Math.min(GRID.length - 1, Math.floor(((e.clientX - box.left - 52) / (box.width - 56)) * GRID.length)))]);
  };
  canvas.addEventListener('pointerdown', (e) => { endGesture(); canvas.setPointerCapture(e.pointerId); at(e); });
  canvas.addEventListener('pointermove', (e) => { if (e.buttons) at(e); });
  canvas.addEventListener('keydown', (e) => {
    const by = { ArrowLeft: -5, ArrowRight: 5 }[e.key], angles = chosen() && anglesOfPosition(chosen());
    if (!by || !angles) return;
    e.preventDefault();
    go(angles[state.axis] + by);
  });
  $('strip-of').addEventListener('change', () => { shownSigma = $('strip-of').value; drawStrip(); });
}
