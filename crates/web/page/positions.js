// The list of positions, and the sliders and fields of the selected one.
import { $, element, finite } from './dom.js';
import { OF_POSITION, fault, faultOf, fill, labelOf, mend, mendAll, numberIn } from './fields.js';
import { AXES, lettersOf, matrixOf, matrixOfLetters, withinTurn } from './geometry.js';
import { say } from './notice.js';
import {
  anglesOfPosition, canRedo, canUndo, chosen, copy, edit, endGesture, nameOfPosition, select, shown, state,
} from './scheme.js';
import { canvasSoon } from './view.js';

function describe(p) {
  const angles = p.attitude ?? (p.angles_deg ?? []).map((a) => (typeof a === 'number' ? shown(a) : a)).join(', ');
  const turns = p.rotation ? `, turns ${p.rotation.angle_deg}\u00b0 about ${p.rotation.about}` : '';
  return `${angles}${turns}`;
}

const focusOn = (i) => $('positions').children[i]?.querySelector('.name').focus();

function move(from, to, focus = false) {
  const count = state.scheme.position.length;
  if (to < 0 || to >= count || from === to) return;
  edit((s) => {
    s.position.splice(to, 0, ...s.position.splice(from, 1));
    state.selected = to;
  });
  say(`${nameOfPosition(chosen(), to)} is now position ${to + 1} of ${count}`, 'unseen');
  if (focus) focusOn(to);
}

export function drawPositions() {
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
  $('undo').disabled = !canUndo();
  $('redo').disabled = !canRedo();
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
export function setAngle(axis, value, as) {
  state.axis = axis;
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

export function makeSliders() {
  AXES.forEach((axis, k) => {
    const range = element('input', { type: 'range', min: -180, max: 180, id: axis });
    const number = element('input', { id: `${axis}-number`, inputMode: 'decimal', autocomplete: 'off' });
    number.setAttribute('aria-label', `${axis} in degrees`);
    const marks = element('div', { className: 'marks', id: `${axis}-marks` });
    marks.setAttribute('aria-hidden', 'true');
    const label = element('label', { htmlFor: axis, textContent: axis });
    range.addEventListener('pointerdown', endGesture);
    range.addEventListener('input', () => setAngle(k, Number(range.value), `slide ${state.selected} ${k}`));
    number.addEventListener('change', () => {
      const x = finite(number.value);
      if (Number.isNaN(x)) return void fault(number.id, `${axis}: expected a number of degrees, found "${number.value}"`);
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

export function drawSelected() {
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
    const kind = faultOf(`${axis}-number`);
    if (kind !== 'own') $(`${axis}-number`).value = angles && kind !== 'engine' ? shown(angles[k]) : String(p?.angles_deg?.[k] ?? '');
  });
  fill('letters', angles && lettersOf(matrixOf(angles)));
  fill('name', p?.name);
  fill('own-dwell', p?.dwell_s);
  canvasSoon();
}

export function wirePositions() {
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
  own('name', 'name', (e) => e.value.trim() || undefined);
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
    else if (state.scheme.position[at + by]) { select(at + by); focusOn(at + by); }
  });
}
