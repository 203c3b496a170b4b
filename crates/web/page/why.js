// Explanations of single verdicts, and the next position of the scheme.
import { $, closable, element, tableOf, two } from './dom.js';
import { behind } from './engine.js';
import { inPageWords } from './fields.js';
import { copy, edit, positionOf, source, state } from './scheme.js';
import { changersOf } from './table.js';
import { verdicts } from './verdicts.js';

const questionOf = (named, name) => JSON.stringify([named, name]);

/** Explains the verdict on an unknown of a text; the answer replaces the content of a box. `more` has options. */
export async function explain(box, named, name, more = {}) {
  const question = questionOf(named, name);
  // an explanation that follows an edit leaves the page where the edit is
  const again = !box.hidden && box.dataset.name === name;
  box.hidden = false;
  box.dataset.name = name;
  box.dataset.question = question;
  if (!box.children.length) box.append(element('p', { className: 'soft', textContent: `Explaining the verdict on ${name}\u2026` }));
  box.classList.add('stale');
  const request = { sources: [named], why: [name], solutions: false, ...more };
  const said = await behind.ask('call', ['analyze', request], { topic: box.id }).catch((problem) => ({ problem }));
  if (!said || box.hidden || box.dataset.question !== question) return;
  box.classList.toggle('stale', box === $('text-why') && $('text').getAttribute('aria-invalid') === 'true');
  const [e] = said.explanations ?? [];
  const head = closable(box, e?.heading ?? name);
  if (!e) return void box.replaceChildren(head, element('p', { textContent: inPageWords(said.problem?.message ?? '') }));
  const lines = element('ul', {}, ...e.lines.map((textContent) => element('li', { textContent })));
  const changes = e.rows.length ? tableOf(e.columns, e.rows, e.improvements) : element('p', { textContent: `${e.improvements}: ${e.no_change}.` });
  box.replaceChildren(head, lines, changes);
  addChangers();
  if (!again) box.scrollIntoView({ block: 'nearest' });
}

/** Explains the verdict on an unknown of the scheme. */
const explainScheme = (name) => explain($('why'), source(state.scheme), name, { omitted: false });

/** Adds to an open explanation the errors that change the estimate, once the figures of the scheme are there. */
function addChangers() {
  const box = $('why');
  if (box.hidden || box.querySelector('.changers') || verdicts.sigmasOf !== JSON.stringify(state.scheme)) return;
  if (box.dataset.question !== questionOf(source(state.scheme), box.dataset.name) || !box.querySelector('ul')) return;
  const changers = changersOf(verdicts.omitted, box.dataset.name);
  if (changers) box.append(changers);
}

/** Asks again for an open explanation of an earlier scheme. */
export function explainAgain() {
  addChangers();
  const box = $('why');
  if (!box.hidden && box.dataset.question !== questionOf(source(state.scheme), box.dataset.name)) explainScheme(box.dataset.name);
}

/** Compares the 24 cardinal attitudes as the next position, and offers the best three. */
async function nextPosition() {
  const box = $('next'), scheme = copy(state.scheme);
  box.hidden = false;
  box.replaceChildren(element('p', { className: 'soft', textContent: 'Comparing the 24 cardinal attitudes\u2026' }));
  const request = { next: 1, keep: 3, conditions_file: source(scheme) };
  const said = await behind.ask('call', ['design', request], { topic: 'next' }).catch((problem) => ({ problem }));
  if (!said || box.hidden || JSON.stringify(scheme) !== JSON.stringify(state.scheme)) return;
  if (said.problem) return void box.replaceChildren(element('p', { textContent: inPageWords(said.problem.message) }));
  const { found } = JSON.parse(said.text);
  const rows = found.map(({ positions: [p], then }) => {
    const add = element('button', { type: 'button', textContent: 'Add' });
    add.setAttribute('aria-label', `Add ${p.candidate} as the last position`);
    add.addEventListener('click', () => edit((s) => {
      const slew = p.half_turn_about && { about: p.half_turn_about, angle_deg: 180 };
      (s.position ??= []).push({ ...positionOf(p.angles, s.gimbals), ...(slew ? { slew } : {}) });
      state.selected = s.position.length - 1;
    }));
    return [add, p.candidate, String(then.worst_degree ?? '\u2013'), String(then.not_observable.length), then.worst ? `${two(then.worst.sigma_dph)} (${then.worst.name})` : ''];
  });
  const texts = said.sentences.map((text) => element('p', { textContent: `${text}.` }));
  box.replaceChildren(...texts, tableOf(['position', 'X_p Y_p Z_p', 'largest degree', 'undetermined', 'worst sigma [deg/h, per g]'], rows));
}

export function wireWhy() {
  $('verdicts').addEventListener('click', (e) => {
    const name = e.target.closest('button.why')?.closest('tr').dataset.name;
    if (name) explainScheme(name);
  });
  $('next-position').addEventListener('click', nextPosition);
}

/** Hides the next position and makes an explanation faint: both are of another scheme. */
export function fadeWhy() {
  $('next').hidden = true;
  $('why').classList.add('stale');
}
