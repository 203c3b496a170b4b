// The conditions of the scheme: carry, terms, latitude, limits, requirements.
import { $, finite } from './dom.js';
import { fault, fill, labelOf, mend, numberIn } from './fields.js';
import { AXES } from './geometry.js';
import { edit, endGesture, isPlain, state } from './scheme.js';

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
export function gimbalLimits(text) {
  const out = {};
  for (const part of text.split(',').filter((t) => t.trim())) {
    const found = /^\s*(alpha|beta|gamma)\s*=\s*([^:]+):([^:]+)$/.exec(part), ends = found?.slice(2).map(finite);
    if (!found || ends.some(Number.isNaN) || `${found[1]}_deg` in out) return null;
    out[`${found[1]}_deg`] = ends;
  }
  return out;
}
/** Gimbal limits in a field; null for another text, which is marked there. */
export function limitsIn(id) {
  const limits = gimbalLimits($(id).value);
  if (!limits) fault(id, `Gimbal limits: expected angles and degrees such as alpha=-90:90, beta=-80:80, found "${$(id).value}"`);
  return limits;
}
export const limitsText = (gimbals = {}) => AXES.filter((axis) => gimbals[`${axis}_deg`]).map((axis) => `${axis}=${gimbals[`${axis}_deg`].join(':')}`).join(', ');

export function wireConditions() {
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
  $('latitude').addEventListener('pointerdown', endGesture);
  $('latitude').addEventListener('input', () => {
    mend('latitude-number');
    setKey('latitude_deg', Number($('latitude').value), 'latitude');
  });
  $('generic').addEventListener('click', () => {
    mend('latitude-number');
    setKey('latitude_deg', undefined);
  });
}

export function drawConditions() {
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
