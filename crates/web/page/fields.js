// Errors at their fields: a field keeps a refused text, with the reason below it.

// fields with an error, and its kind: `own` for a text that the page refuses, `engine` for a value of the scheme
const faults = new Map();
// fields of the selected position
const OF_POSITION = ['alpha-number', 'beta-number', 'gamma-number', 'letters', 'name', 'own-dwell'];
// fields by the key of a scheme file; a table stands for all its keys
const FIELDS = {
  carry: 'carry', terms: 'terms', latitude_deg: 'latitude-number', requirements: 'requirements', bench: 'bench',
  'simulation.dwell_s': 'dwell', 'simulation.accelerometer_noise_g': 'noise', 'simulation.drift_noise': 'drift-noise',
  'position.name': 'name', 'position.dwell_s': 'own-dwell', 'position.attitude': 'letters', 'position.angles_deg': 'alpha-number',
};

/** Shows an error under a field. */
function fault(id, message, kind = 'own') {
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
const labelOf = (id) => $(id).getAttribute('aria-label')?.split(' in ')[0] ?? [...$(id).labels[0].childNodes].find((n) => n.nodeType === Node.TEXT_NODE).textContent.trim();

/** Removes the error of a field. */
function mend(id) {
  if (!faults.delete(id)) return;
  const field = $(id), { hint } = field.dataset;
  $(`${id}-wrong`)?.remove();
  field.removeAttribute('aria-invalid');
  if (hint) field.setAttribute('aria-describedby', hint); else field.removeAttribute('aria-describedby');
}

/** Removes the errors of some fields, or of a kind. */
const mendAll = (ids) => ids.forEach(mend);
const mendKind = (kind) => mendAll([...faults].filter(([, k]) => k === kind).map(([id]) => id));

/** Sets the value of a field, unless it has the focus or a text that was refused. */
function fill(id, value) {
  if (document.activeElement !== $(id) && faults.get(id) !== 'own') $(id).value = value ?? '';
}

/** Key of a scheme file at an offset of its text, and the index of its position. */
function keyAt(text, offset) {
  let table = '', position = -1, key = '';
  for (const line of text.slice(0, text.indexOf('\n', offset) + 1 || undefined).split('\n')) {
    const head = /^\[+([\w-]+)\]+$/.exec(line), name = /^("(?:[^"\\]|\\.)*"|[\w-]+) =/.exec(line);
    if (head) { table = head[1]; key = ''; position += table === 'position'; }
    if (name) key = name[1];
  }
  return { position: table === 'position' ? position : null, keys: table ? [`${table}.${key}`, table] : [key] };
}

/** Shows an error of the engine at the field of its value, or above all if it has no field here. */
function wrongAt(problem, text) {
  const { place } = problem, { position, keys } = place ? keyAt(text, place.start) : { position: null, keys: [] };
  const id = keys.map((key) => FIELDS[key]).find(Boolean);
  if (id && (position === null || position === state.selected)) {
    // the field's name instead of the key
    return fault(id, keys[0].includes('.') ? problem.message.replace(keys[0], labelOf(id)) : problem.message, 'engine');
  }
  const where = position === null ? '' : `${nameOfPosition(state.scheme.position[position], position)}: `;
  return wrong({ message: `${where}${problem.message}` });
}
