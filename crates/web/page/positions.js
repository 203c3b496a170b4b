// The list of positions, the sliders of the selected position, and the conditions.

const $ = (id) => document.getElementById(id);
const AXES = ['alpha', 'beta', 'gamma'];

function element(tag, properties = {}, ...children) {
  const e = Object.assign(document.createElement(tag), properties);
  e.append(...children);
  return e;
}

// rounded to 1e-9 deg, the resolution of angles
const shown = (x) => decimal(Math.round(x * 1e9) / 1e9).replace('-', '\u2212');
const chosen = () => state.scheme.position?.[state.selected];

function describe(p) {
  const angles = p.attitude ?? (p.angles_deg ?? []).map((a) => (typeof a === 'number' ? shown(a) : a)).join(', ');
  const turns = p.rotation ? `, turns ${p.rotation.angle_deg}\u00b0 about ${p.rotation.about}` : '';
  return `${angles}${turns}`;
}

function select(i, focus = false) {
  state.selected = i;
  gesture = null;
  drawPositions();
  drawSelected();
  wrongAgain();
  askBehind();
  if (focus) $('positions').children[i]?.querySelector('.name').focus();
}

function move(from, to, focus = false) {
  const count = state.scheme.position.length;
  if (to < 0 || to >= count || from === to) return;
  edit((s) => {
    s.position.splice(to, 0, ...s.position.splice(from, 1));
    state.selected = to;
  });
  say(`${nameOfPosition(chosen(), to)} is now position ${to + 1} of ${count}`, 'unseen');
  if (focus) $('positions').children[to]?.querySelector('.name').focus();
}

function drawPositions() {
  const list = $('positions'), all = state.scheme.position ?? [];
  while (list.children.length > all.length) list.lastChild.remove();
  while (list.children.length < all.length) list.append(row());
  all.forEach((p, i) => {
    const li = list.children[i], text = `${nameOfPosition(p, i)}   ${describe(p)}`;
    const button = li.querySelector('.name');
    if (button.textContent !== text) {
      button.textContent = text;
      li.querySelectorAll('.moves button').forEach((b, k) => b.setAttribute('aria-label', `Move ${nameOfPosition(p, i)} ${k ? 'down' : 'up'}`));
    }
    li.classList.toggle('chosen', i === state.selected);
    button.setAttribute('aria-current', i === state.selected ? 'true' : 'false');
  });
  for (const id of ['duplicate', 'delete', 'slew']) $(id).disabled = !all.length;
  $('undo').disabled = !past.length;
  $('redo').disabled = !future.length;
}

const indexOf = (e) => [...$('positions').children].indexOf(e.closest('li'));

function row() {
  const grip = element('span', { className: 'grip', textContent: '\u2261', title: 'Drag to another place' });
  grip.setAttribute('aria-hidden', 'true');
  grip.addEventListener('pointerdown', lift);
  const name = element('button', { className: 'name', type: 'button' });
  name.addEventListener('click', () => select(indexOf(name)));
  const moves = [-1, 1].map((by) => {
    const b = element('button', { type: 'button', textContent: by < 0 ? '\u2191' : '\u2193' });
    b.addEventListener('click', () => move(indexOf(b), indexOf(b) + by));
    return b;
  });
  return element('li', {}, grip, name, element('small', { className: 'need' }), element('span', { className: 'moves' }, ...moves));
}

/** Drags a position to the place in the list where the pointer is released. */
function lift(e) {
  e.preventDefault();
  const grip = e.currentTarget, list = $('positions'), from = indexOf(grip);
  const line = grip.closest('li');
  grip.setPointerCapture(e.pointerId);
  line.classList.add('lifted');
  const unmark = () => list.querySelectorAll('.before, .after').forEach((l) => l.classList.remove('before', 'after'));
  const target = (y) => {
    const at = [...list.children].findIndex((l) => y < l.getBoundingClientRect().bottom);
    return at < 0 ? list.children.length - 1 : at;
  };
  const over = (m) => {
    unmark();
    const edge = list.getBoundingClientRect();
    if (m.clientY < edge.top + 16) list.scrollTop -= 12;
    if (m.clientY > edge.bottom - 16) list.scrollTop += 12;
    const to = target(m.clientY);
    if (to !== from) list.children[to].classList.add(to < from ? 'before' : 'after');
  };
  const drop = (m) => {
    unmark();
    line.classList.remove('lifted');
    for (const [kind, f] of [['pointermove', over], ['pointerup', drop], ['pointercancel', drop]]) grip.removeEventListener(kind, f);
    if (m.type === 'pointerup') move(from, target(m.clientY));
  };
  for (const [kind, f] of [['pointermove', over], ['pointerup', drop], ['pointercancel', drop]]) grip.addEventListener(kind, f);
}

/** Sets one Euler angle of the selected position. */
function setAngle(axis, value, as) {
  mendAll(['letters', `${AXES[axis]}-number`]);
  // the other two angles stay, also if they are names
  const { angles_deg: own } = chosen();
  const before = anglesOfPosition(chosen()) ?? (own?.length === 3 ? own : [0, 0, 0]);
  edit(() => {
    const p = chosen();
    delete p.attitude;
    p.angles_deg = before.map((x, k) => (k === axis ? value : x));
  }, as);
}

function makeSliders() {
  AXES.forEach((axis, k) => {
    const range = element('input', { type: 'range', min: -180, max: 180, id: axis });
    const number = element('input', { id: `${axis}-number`, inputMode: 'decimal', autocomplete: 'off' });
    number.setAttribute('aria-label', `${axis} in degrees`);
    const marks = element('div', { className: 'marks', id: `${axis}-marks` });
    marks.setAttribute('aria-hidden', 'true');
    const label = element('label', { htmlFor: axis, textContent: axis });
    range.addEventListener('pointerdown', () => { gesture = null; });
    range.addEventListener('input', () => {
      live.began = performance.now();
      strip.axis = k;
      setAngle(k, Number(range.value), `slide ${state.selected} ${k}`);
    });
    range.addEventListener('focus', () => { strip.axis = k; drawStrip(); });
    number.addEventListener('change', () => {
      const x = finite(number.value);
      if (Number.isNaN(x)) return void fault(number.id, `${axis}: expected a number of degrees, found "${number.value}"`);
      strip.axis = k;
      setAngle(k, x);
    });
    $('sliders').append(element('div', { className: 'slider' }, label, range, number, marks));
  });
  const snap = () => AXES.forEach((axis) => { $(axis).step = $('snap').value; drawSelected(); });
  $('snap').addEventListener('change', snap);
  snap();
}

// the position that the fields are of
let drawn = null;
/** An angle in degrees as the sliders have it, from -180 to 180. */
const withinTurn = (angle) => (Math.abs(angle) <= 180 ? angle : angle - 360 * Math.round(angle / 360));

function drawSelected() {
  const p = chosen();
  // errors of another position are not errors of this one
  if (p !== drawn) mendAll(OF_POSITION);
  drawn = p;
  $('attitude').disabled = !p;
  $('which').textContent = p ? nameOfPosition(p, state.selected) : 'no position';
  const angles = p && anglesOfPosition(p);
  AXES.forEach((axis, k) => {
    if (angles) $(axis).value = withinTurn(angles[k]);
    $(axis).disabled = !angles;
    $(axis).setAttribute('aria-valuetext', angles ? `${shown(angles[k])} degrees` : 'by name');
    // what is typed has been taken over, or refused
    const kind = faults.get(`${axis}-number`);
    if (kind !== 'own') $(`${axis}-number`).value = angles && kind !== 'engine' ? shown(angles[k]) : String(p?.angles_deg?.[k] ?? '');
  });
  fill('letters', angles && lettersOf(matrixOf(angles)));
  fill('name', p?.name);
  fill('own-dwell', p?.dwell_s);
  canvasSoon();
}

/** Number in a field; undefined if the field is empty, NaN if it holds no number. */
const numberIn = (e) => (e.value.trim() === '' ? undefined : finite(e.value));
const finite = (text) => {
  const plain = text?.trim().replace('\u2212', '-') ?? '', x = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
  return Number.isFinite(x) ? x : NaN;
};

/** Sets a value of the scheme, or removes it. */
function setKey(path, value, as) {
  edit((s) => {
    const keys = path.split('.'), last = keys.pop();
    const at = keys.reduce((o, k) => (o[k] ??= {}), s);
    if (value === undefined) delete at[last]; else at[last] = value;
  }, as);
}

/** Names and numbers such as `D = 0.05, psi = 0.01`; NaN for what is no number, or a name that comes twice. */
function assignments(text) {
  const out = {};
  for (const part of text.split(',').filter((t) => t.trim())) {
    const [name, ...values] = part.split('=').map((x) => x.trim());
    out[name || part] = !name || values.length !== 1 || name in out ? NaN : finite(values[0]);
  }
  return out;
}

/** Limits of gimbals such as `alpha=-90:90, beta=-80:80` as a table of a scheme file; null for another text. */
function gimbalLimits(text) {
  const out = {};
  for (const part of text.split(',').filter((t) => t.trim())) {
    const found = /^\s*(alpha|beta|gamma)\s*=\s*([^:]+):([^:]+)$/.exec(part), ends = found?.slice(2).map(finite);
    if (!found || ends.some(Number.isNaN) || `${found[1]}_deg` in out) return null;
    out[`${found[1]}_deg`] = ends;
  }
  return out;
}
/** Gimbal limits in a field; null for another text, which is marked there. */
function limitsIn(id) {
  const limits = gimbalLimits($(id).value);
  if (!limits) fault(id, `Gimbal limits: expected angles and degrees such as alpha=-90:90, beta=-80:80, found "${$(id).value}"`);
  return limits;
}
const limitsText = (gimbals = {}) => AXES.filter((axis) => gimbals[`${axis}_deg`]).map((axis) => `${axis}=${gimbals[`${axis}_deg`].join(':')}`).join(', ');

function wireConditions() {
  const field = (id, path, read) => $(id).addEventListener('change', () => {
    const value = read($(id));
    if (Number.isNaN(value) || (isPlain(value) && Object.values(value).some(Number.isNaN))) {
      const wanted = isPlain(value) ? `names and numbers such as ${id === 'bench' ? 'K0 = 20' : 'D = 0.05'}` : 'a number';
      return void fault(id, `${labelOf(id)}: expected ${wanted}, found "${$(id).value}"`);
    }
    mend(id);
    setKey(path, value);
  });
  const text = (e) => e.value.trim() || undefined;
  field('carry', 'carry', text);
  field('terms', 'terms', (e) => (e.value.trim() === 'drift' ? 'drift' : text(e)?.split(',').map((t) => t.trim()).filter(Boolean)));
  field('dwell', 'simulation.dwell_s', numberIn);
  field('noise', 'simulation.accelerometer_noise_g', numberIn);
  field('drift-noise', 'simulation.drift_noise', text);
  field('latitude-number', 'latitude_deg', numberIn);
  field('slew-rate', 'simulation.slew_rate_deg_s', numberIn);
  $('gimbals').addEventListener('change', () => {
    const limits = limitsIn('gimbals');
    if (!limits) return;
    mend('gimbals');
    setKey('gimbals', Object.keys(limits).length ? limits : undefined);
  });
  for (const table of ['requirements', 'bench']) field(table, table, (e) => (e.value.trim() ? assignments(e.value) : undefined));
  $('latitude').addEventListener('pointerdown', () => { gesture = null; });
  $('latitude').addEventListener('input', () => {
    mend('latitude-number');
    setKey('latitude_deg', Number($('latitude').value), 'latitude');
  });
  $('generic').addEventListener('click', () => {
    mend('latitude-number');
    setKey('latitude_deg', undefined);
  });
  $('letters').addEventListener('change', () => {
    const letters = $('letters').value.trim().toUpperCase();
    if (!matrixOfLetters(letters)) return void fault('letters', `X_p Y_p Z_p: expected directions of right-handed axes such as NUE, found "${letters}"`);
    mendAll(['letters', ...AXES.map((axis) => `${axis}-number`)]);
    edit(() => { const p = chosen(); delete p.angles_deg; p.attitude = letters; });
  });
  const own = (id, key, read) => $(id).addEventListener('change', () => {
    const value = read($(id));
    if (Number.isNaN(value)) return void fault(id, `${labelOf(id)}: expected a number of seconds, found "${$(id).value}"`);
    mend(id);
    edit(() => { if (value === undefined) delete chosen()[key]; else chosen()[key] = value; });
  });
  own('name', 'name', text);
  own('own-dwell', 'dwell_s', numberIn);
  $('add').addEventListener('click', () => edit((s) => {
    s.position.push({ angles_deg: [0, 0, 0] });
    state.selected = s.position.length - 1;
  }));
  $('duplicate').addEventListener('click', () => edit((s) => {
    const twin = copy(chosen());
    delete twin.name;
    s.position.splice(++state.selected, 0, twin);
  }));
  $('delete').addEventListener('click', () => {
    edit((s) => s.position.splice(state.selected, 1));
    if (!state.scheme.position.length) $('add').focus();
  });
  $('positions').addEventListener('keydown', (e) => {
    const by = { ArrowUp: -1, ArrowDown: 1 }[e.key];
    if (e.key === 'Delete') { e.preventDefault(); return $('delete').click(); }
    if (!by) return;
    e.preventDefault();
    const at = indexOf(e.target);
    if (e.altKey) move(at, at + by, true);
    else if (state.scheme.position[at + by]) select(at + by, true);
  });
}

function drawConditions() {
  const s = state.scheme, run = s.simulation ?? {};
  fill('carry', s.carry ?? 'platform');
  fill('terms', Array.isArray(s.terms) ? s.terms.join(',') : s.terms ?? 'F,I,O,S');
  fill('dwell', run.dwell_s);
  fill('noise', run.accelerometer_noise_g);
  fill('drift-noise', run.drift_noise);
  fill('latitude-number', s.latitude_deg);
  fill('slew-rate', run.slew_rate_deg_s);
  fill('gimbals', limitsText(s.gimbals));
  $('latitude').value = s.latitude_deg ?? 28.2;
  $('latitude-note').textContent = s.latitude_deg === undefined ? 'Verdicts hold at nearly every latitude; sigmas and the arrow of the earth rate are of 28.2 deg.' : '';
  $('latitude').setAttribute('aria-valuetext', s.latitude_deg === undefined ? 'generic' : `${s.latitude_deg} degrees`);
  for (const table of ['requirements', 'bench']) fill(table, Object.entries(s[table] ?? {}).map(([k, v]) => `${k} = ${v}`).join(', '));
}
