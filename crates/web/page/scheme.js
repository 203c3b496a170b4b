// The edited scheme: an object laid out as a scheme file, with its history, as TOML and as a link.
import { anglesOf, lettersOf, matrixOf, matrixOfLetters } from './geometry.js';

const START = { carry: 'platform', position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [180, 0, 0] }] };
export const copy = (x) => JSON.parse(JSON.stringify(x));

// the scheme, its name, the index of the selected position, and the angle whose slider was used last
export const state = { scheme: copy(START), name: 'scheme.toml', selected: 0, axis: 0 };
const past = [], future = [];
// edits of one gesture, such as dragging a slider, are undone in one step
let gesture = null;

// by event. gesture: a step of the history begins; edit: the scheme is about to change; replaced: it is another one
// (true if opened from a file or link); changed: it has changed (since the time in ms); selected: another position is
const listeners = { gesture: [], edit: [], replaced: [], changed: [], selected: [] };
/** Adds listeners to an event, in the order in which they are called. */
export const on = (event, ...added) => listeners[event].push(...added);
const tell = (event, ...args) => listeners[event].forEach((listener) => listener(...args));

export const chosen = () => state.scheme.position?.[state.selected];
export const source = (scheme, name = state.name) => ({ name, text: toToml(scheme) });

/** Euler angles of a position in deg; null if one of them is a name. */
export function anglesOfPosition(p) {
  if (typeof p.attitude === 'string') {
    const c = matrixOfLetters(p.attitude);
    return c && anglesOf(c);
  }
  const angles = p.angles_deg?.map(Number);
  return angles?.length === 3 && angles.every(Number.isFinite) ? angles : null;
}

export const nameOfPosition = (p, i) => p.name ?? `p${i + 1}`;

/** Position from the angles of an answer: by letters, unless gimbal limits require these angles. */
export function positionOf(text, gimbals) {
  const angles = text.split(',').map(Number);
  const letters = !gimbals && angles.every(Number.isFinite) ? lettersOf(matrixOf(angles)) : null;
  if (letters) return { attitude: letters };
  return { angles_deg: text.split(',').map((t) => (Number.isFinite(Number(t)) ? Number(t) : t.trim())) };
}

const remember = (list) => list.push(JSON.stringify([state.scheme, state.selected, state.name]));

/** Changes the scheme; `as` names the gesture that the change belongs to. */
export function edit(change, as = null) {
  const began = performance.now();
  if (!as || gesture !== as) {
    remember(past);
    if (past.length > 500) past.shift();
    tell('gesture');
  }
  gesture = as;
  tell('edit');
  future.length = 0;
  change(state.scheme);
  changed(began);
}

/** The next edit is a step of its own in the history, also if it has the name of the last gesture. */
export function endGesture() { gesture = null; }

/** Selects a position by its index. */
export function select(index) {
  state.selected = index;
  endGesture();
  tell('selected');
}

/** Tells that the scheme has changed, since a time in ms. */
export function changed(began = performance.now()) {
  const last = Math.max(0, (state.scheme.position?.length ?? 0) - 1);
  state.selected = Math.max(0, Math.min(state.selected, last));
  tell('changed', began);
}

function restore(from, to) {
  if (!from.length) return;
  remember(to);
  [state.scheme, state.selected, state.name] = JSON.parse(from.pop());
  endGesture();
  tell('gesture');
  tell('replaced', false);
  changed();
}

export const undo = () => restore(past, future);
export const redo = () => restore(future, past);
export const canUndo = () => past.length > 0;
export const canRedo = () => future.length > 0;

/** Replaces the scheme by another; `opened` if that is from a file or a link. */
export function replace(scheme, name, opened = false) {
  edit(() => {
    state.scheme = scheme;
    state.scheme.position ??= [];
    state.name = name;
    state.selected = 0;
    tell('replaced', opened);
  });
}

const DATE = '$__toml_private_datetime';
export const isPlain = (x) => x !== null && typeof x === 'object' && !Array.isArray(x);

function tomlValue(v) {
  if (typeof v === 'string') return JSON.stringify(v).replaceAll('\u007f', '\\u007f');
  if (Array.isArray(v)) return `[${v.map(tomlValue).join(', ')}]`;
  // a date of TOML, as the engine hands it over
  if (isPlain(v) && /^[\dTtZz:.+ -]+$/.test(v[DATE] ?? '')) return v[DATE];
  if (isPlain(v)) return `{ ${Object.entries(v).map(([k, x]) => `${tomlKey(k)} = ${tomlValue(x)}`).join(', ')} }`;
  return typeof v === 'number' ? decimal(v) : String(v);
}

/** A small number without an exponent: angles are decimals. */
function decimal(x) {
  const [digits, power] = String(x).split('e-');
  if (!power) return digits;
  const [, sign, whole, part = ''] = /^(-?)(\d)\.?(\d*)$/.exec(digits);
  return `${sign}0.${'0'.repeat(power - 1)}${whole}${part}`;
}

const tomlKey = (k) => (/^[A-Za-z0-9_-]+$/.test(k) ? k : tomlValue(k));

/** A scheme as TOML. */
export function toToml(scheme) {
  const out = [];
  const lines = (table) => Object.entries(table).filter(([, v]) => v !== undefined)
    .forEach(([k, v]) => out.push(`${tomlKey(k)} = ${tomlValue(v)}`));
  const { position = [], ...rest } = scheme;
  const isTable = (v) => isPlain(v) && !(DATE in v), tables = Object.entries(rest).filter(([, v]) => isTable(v));
  lines(Object.fromEntries(Object.entries(rest).filter(([, v]) => !isTable(v))));
  for (const [k, v] of tables) {
    if (!Object.keys(v).length) continue;
    out.push('', `[${tomlKey(k)}]`);
    lines(v);
  }
  for (const p of position) {
    out.push('', '[[position]]');
    lines(p);
  }
  return `${out.join('\n').trim()}\n`;
}

// rounded to 1e-9 deg, the resolution of angles
export const shown = (x) => decimal(Math.round(x * 1e9) / 1e9).replace('-', '\u2212');

/** A text encoded for the page's address. */
export function packed(text) {
  const binary = Array.from(new TextEncoder().encode(text), (b) => String.fromCharCode(b)).join('');
  return btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

export function unpacked(text) {
  try {
    const binary = atob(text.replaceAll('-', '+').replaceAll('_', '/'));
    return new TextDecoder('utf-8', { fatal: true }).decode(Uint8Array.from(binary, (c) => c.charCodeAt(0)));
  } catch {
    return null;
  }
}
