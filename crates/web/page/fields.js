// Fields and their errors: a field keeps a refused text, with the reason below it.
import { $, element, finite, put } from './dom.js';
import { AXES } from './geometry.js';

// fields with an error, and its kind: `own` for a text that the page refuses, `engine` for a value of the scheme
const faults = new Map();
// fields of the selected position
export const OF_POSITION = ['alpha-number', 'beta-number', 'gamma-number', 'letters', 'name', 'own-dwell'];
// fields by the key of a scheme file; a table stands for all its keys
const FIELDS = {
  carry: 'carry', terms: 'terms', latitude_deg: 'latitude-number', requirements: 'requirements', bench: 'bench', gimbals: 'gimbals',
  'simulation.dwell_s': 'dwell', 'simulation.accelerometer_noise_g': 'noise', 'simulation.drift_noise': 'drift-noise', 'simulation.slew_rate_deg_s': 'slew-rate',
  'position.name': 'name', 'position.dwell_s': 'own-dwell', 'position.attitude': 'letters',
};
// fields by what an error without a key says
const SAID = [[/positions are named/, 'name'], [/gimbals do not reach/, 'gimbals'], [/^slews of finite/, 'slew-rate']];

/** A text of the engine with the names of fields in place of keys. */
export function inPageWords(text) {
  const dotted = Object.entries(FIELDS).filter(([key]) => key.includes('.')).reduce((words, [key, id]) => words.replaceAll(key, labelOf(id)), text);
  const tables = ['requirements', 'bench', 'gimbals'].reduce((words, id) => words.replace(new RegExp(`\\b${id}\\.(?=[A-Za-z])`, 'g'), `${labelOf(id)}: `), dotted);
  return tables.replace(/\bslew_rate_deg_s\b/, labelOf('slew-rate'));
}

/** Shows an error under a field. */
export function fault(id, message, kind = 'own') {
  const field = $(id), line = $(`${id}-wrong`) ?? element('p', { id: `${id}-wrong`, className: 'wrong' });
  line.setAttribute('role', 'alert');
  put(line, message);
  if (!line.isConnected) (field.closest('.slider, label') ?? field).after(line);
  field.dataset.hint ??= field.getAttribute('aria-describedby') ?? '';
  field.setAttribute('aria-describedby', `${field.dataset.hint} ${line.id}`.trim());
  field.setAttribute('aria-invalid', 'true');
  faults.set(id, kind);
}

/** Name of a field on the page. */
export const labelOf = (id) => $(id).getAttribute('aria-label')?.split(' in ')[0] ?? [...$(id).labels[0].childNodes].find((n) => n.nodeType === Node.TEXT_NODE).textContent.trim();

/** Kind of the error of a field: `own` or `engine`; undefined if it has none. */
export const faultOf = (id) => faults.get(id);
/** Fields of a search that have an error. */
export const searchFaults = () => [...faults.keys()].filter((id) => id.startsWith('design-'));

/** Removes the error of a field. */
export function mend(id) {
  if (!faults.delete(id)) return;
  const field = $(id), { hint } = field.dataset;
  $(`${id}-wrong`)?.remove();
  field.removeAttribute('aria-invalid');
  if (hint) field.setAttribute('aria-describedby', hint); else field.removeAttribute('aria-describedby');
}

/** Removes the errors of some fields, of all fields of the scheme, or of a kind. */
export const mendAll = (ids) => ids.forEach(mend);
export const mendScheme = () => mendAll([...faults.keys()].filter((id) => !id.startsWith('design-')));
export const mendKind = (kind) => mendAll([...faults].filter(([, k]) => k === kind).map(([id]) => id));

/** Sets the value of a field, unless it has the focus or a text that was refused. */
export function fill(id, value) {
  if (document.activeElement !== $(id) && faults.get(id) !== 'own') $(id).value = value ?? '';
}

/** Key of a scheme file at an offset of its text, the index of its position, and the index in a list. */
export function keyAt(text, offset) {
  const lines = text.slice(0, text.indexOf('\n', offset) + 1 || undefined).trimEnd().split('\n');
  let table = '', position = -1, key = '';
  for (const line of lines) {
    const head = /^\[+([\w-]+)\]+$/.exec(line), name = /^("(?:[^"\\]|\\.)*"|[\w-]+) =/.exec(line);
    if (head) { table = head[1]; key = ''; position += table === 'position'; }
    if (name) key = name[1];
  }
  const before = text.slice(text.lastIndexOf('\n', offset - 1) + 1, offset), index = before.includes('[') ? before.split(',').length - 1 : 0;
  return { position: table === 'position' ? position : null, keys: table ? [`${table}.${key}`, table] : [key], index };
}

/** Field that an error of the engine is about; null if it has no field here. */
export function fieldOf(problem, { keys, index }) {
  const said = SAID.find(([of]) => of.test(problem.message))?.[1];
  return said ?? (keys[0] === 'position.angles_deg' ? `${AXES[index] ?? AXES[0]}-number` : keys.map((key) => FIELDS[key]).find(Boolean)) ?? null;
}

/** Number in a field; undefined if the field is empty, NaN if it holds no number. */
export const numberIn = (e) => (e.value.trim() === '' ? undefined : finite(e.value));
