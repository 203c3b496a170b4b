// The edited scheme: an object laid out as a scheme file, with its history, as TOML and as a link.

const START = { carry: 'platform', position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [180, 0, 0] }] };
const copy = (x) => JSON.parse(JSON.stringify(x));

const state = { scheme: copy(START), name: 'scheme.toml', selected: 0 };
const past = [], future = [], listeners = [];
// edits of one gesture, such as dragging a slider, are undone in one step
let gesture = null;

const DATE = '$__toml_private_datetime';
const isPlain = (x) => x !== null && typeof x === 'object' && !Array.isArray(x);

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
function toToml(scheme) {
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

/** Euler angles of a position in deg; null if one of them is a name. */
function anglesOfPosition(p) {
  if (typeof p.attitude === 'string') {
    const c = matrixOfLetters(p.attitude);
    return c && anglesOf(c);
  }
  const angles = p.angles_deg?.map(Number);
  return angles?.length === 3 && angles.every(Number.isFinite) ? angles : null;
}

const nameOfPosition = (p, i) => p.name ?? `p${i + 1}`;

/** Changes the scheme; `as` names the gesture that the change belongs to. */
function edit(change, as = null) {
  if (!as || gesture !== as) {
    past.push(JSON.stringify([state.scheme, state.selected, state.name]));
    if (past.length > 500) past.shift();
    emphasise();
  }
  gesture = as;
  if ($('notice').className === 'fine') say('');
  future.length = 0;
  change(state.scheme);
  changed();
}

function changed() {
  const last = Math.max(0, (state.scheme.position?.length ?? 0) - 1);
  state.selected = Math.max(0, Math.min(state.selected, last));
  for (const listener of listeners) listener();
}

function restore(from, to) {
  if (!from.length) return;
  to.push(JSON.stringify([state.scheme, state.selected, state.name]));
  [state.scheme, state.selected, state.name] = JSON.parse(from.pop());
  gesture = null;
  emphasise();
  mendScheme();
  if (state.name !== TOUR_FILE) quitTour();
  changed();
}

const undo = () => restore(past, future);
const redo = () => restore(future, past);

/** Replaces the scheme by another. */
function replace(scheme, name = 'scheme.toml') {
  mendScheme();
  edit(() => {
    state.scheme = scheme;
    state.scheme.position ??= [];
    state.name = name;
    state.selected = 0;
  });
}

/** A text encoded for the page's address. */
function packed(text) {
  const binary = Array.from(new TextEncoder().encode(text), (b) => String.fromCharCode(b)).join('');
  return btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

function unpacked(text) {
  try {
    const binary = atob(text.replaceAll('-', '+').replaceAll('_', '/'));
    return new TextDecoder('utf-8', { fatal: true }).decode(Uint8Array.from(binary, (c) => c.charCodeAt(0)));
  } catch {
    return null;
  }
}
