// The text of a scheme or model, and its verdicts.
import { $, element, put, putName, putSolution, tableOf } from './dom.js';
import { DATA, LATE, live } from './engine.js';
import { say, wrong } from './notice.js';
import { replace, state, toToml } from './scheme.js';
import { WORDS, drawSentences } from './table.js';
import { show } from './tabs.js';
import { explain } from './why.js';

/** The line of a text with the place of a problem marked under it. */
function placed(text, { line, start, end }) {
  const from = text.lastIndexOf('\n', start - 1) + 1, whole = text.slice(from).split('\n', 1)[0], cut = Math.max(0, start - from - 40);
  const shownLine = whole.slice(cut, cut + 72), marked = Math.max(1, Math.min(end, from + whole.length) - start);
  const head = `${line} | `;
  return `${head}${shownLine}\n${' '.repeat(head.length + start - from - cut)}${'^'.repeat(Math.min(marked, 72))}`;
}

/** Judges the text in the editor. */
async function judgeText() {
  const text = $('text').value;
  const faint = (on) => ['text-verdicts', 'text-why'].forEach((id) => $(id).classList.toggle('stale', on));
  const late = setTimeout(() => {
    faint(true);
    put($('text-old'), $('text-verdicts').children.length ? 'Judging: what follows is of the text before.' : 'Judging\u2026');
  }, LATE);
  const found = await live.ask('verdicts', [{ sources: [{ name: writing.name, text }] }], { topic: 'text' }).catch((p) => ({ problem: p })).finally(() => clearTimeout(late));
  if (!found || text !== $('text').value) return;
  const area = $('text'), { problem, answer, math, sentences } = found;
  area.setAttribute('aria-invalid', problem ? 'true' : 'false');
  $('text-problem').replaceChildren();
  // the last answer stays while the text is wrong
  faint(!!problem);
  put($('text-old'), problem && $('text-verdicts').children.length ? 'The text is wrong: what follows is of the text before.' : '');
  if (problem) {
    const { place, message } = problem;
    $('text-problem').append(place ? `Line ${place.line}, column ${place.column}: ${message} ` : message);
    if (place) {
      const mark = element('pre', { textContent: placed(text, place) });
      mark.setAttribute('aria-hidden', 'true');
      $('text-problem').append(mark);
      const go = element('button', { type: 'button', textContent: 'Show the place' });
      go.addEventListener('click', () => {
        area.focus();
        area.setSelectionRange(place.start, Math.max(place.end, place.start + 1));
        area.scrollTop = Math.max(0, (place.line - 4)) * parseFloat(getComputedStyle(area).lineHeight);
      });
      $('text-problem').append(go);
    }
    return;
  }
  $('text-why').hidden = true;
  $('text-why').replaceChildren();
  const named = (q) => {
    const e = element('button', { type: 'button', className: 'why', title: 'Why this verdict, and what changes it' });
    putName(e, math[q.name ?? q.expression], q.name ?? q.expression);
    e.addEventListener('click', () => explain($('text-why'), { name: writing.name, text }, q.name ?? q.expression));
    return e;
  };
  const solved = (s) => {
    const text = s === null || s === undefined ? '' : s.text ?? s;
    const e = element('span');
    putSolution(e, math[text], text, s?.terms?.length ?? 0);
    return e;
  };
  const rows = answer.quantities.map((q) => [named(q), q.unit, WORDS[q.status] ?? q.status.replaceAll('_', ' '), String(q.degree ?? '\u2013'),
    q.degree === null ? (q.partners?.length ? `not told from ${q.partners.join(', ')}` : '') : solved(q.solution)]);
  const parts = [tableOf(['unknown', 'unit', 'status', 'degree', 'solution, or why none'], rows, `rank ${answer.rank} of ${answer.unknowns.length ?? answer.unknowns}`)];
  const lines = element('div');
  drawSentences(lines, sentences);
  parts.unshift(lines);
  if (answer.quantities.some((q) => q.degree !== null && !q.solution)) {
    parts.push(element('p', { className: 'soft', textContent: 'Solutions that are not here need the symbolic engine, which the command line has.' }));
  }
  const list = (title, items) => items?.length && parts.push(element('h3', { textContent: title }), element('ul', {}, ...items.map((t) => element('li', { textContent: t }))));
  list('Symmetries: these changes move no output', answer.symmetries?.map((s) => s.words));
  list('No other polynomial change is known', answer.other_directions?.map((names) => `${names.join(', ')} move together`));
  const none = answer.rests_on_bound ? `not seen up to order ${answer.last_order}` : 'not observable';
  const judged = (c) => `${c.expression}: ${c.degree === null ? none : `observable, degree ${c.degree}`}`;
  list('Identifiable combinations', answer.invariants?.map(judged));
  list('Combinations', answer.combinations?.map(judged));
  $('text-verdicts').replaceChildren(...parts);
}

// name of the text; true if it is not that of the scheme
export const writing = { name: 'scheme.toml', own: false };

/** Puts the text of the scheme into the editor, unless the editor has a text of its own. */
export function renewText() {
  if (!writing.own) setText(toToml(state.scheme), state.name);
}

export function setText(text, name) {
  $('text').value = text;
  writing.name = name;
  judgeText();
}

/** Takes the text over as positions. */
async function take() {
  const name = writing.name;
  if (!(await openText($('text').value, name)) && $('text').getAttribute('aria-invalid') !== 'true') wrong({ message: `${name} is a model; expected a scheme, with [[position]] tables` });
}

/** Opens a text: a scheme as positions, anything else in the editor. */
export async function openText(text, name) {
  const [read, judged] = await Promise.all([live.ask('toml', [text]), live.ask('call', ['analyze', { sources: [{ name, text }], solutions: false, omitted: false }])])
    .catch((p) => [{ problem: p }, {}]);
  const value = read.value, scheme = value && Array.isArray(value.position) && !value.states;
  if (scheme && !judged.problem) {
    replace(value, name, true);
    writing.own = false;
    show('scheme');
    say(`${name} is open.`, 'fine');
    return true;
  }
  writing.own = true;
  setText(text, name);
  show('text');
  const problem = judged.problem ?? read.problem;
  if (problem) say(problem.message.startsWith(name) ? problem.message : `${name}: ${problem.message}`);
  return false;
}

export function wireText() {
  // pause before the text is judged
  let pause = null;
  DATA.examples.forEach((e, i) => $('gallery').append(element('option', { value: i, textContent: e.kind === 'model' ? `${e.name} (model)` : e.name })));
  $('gallery').addEventListener('change', () => {
    const e = DATA.examples[$('gallery').value];
    if (!e) return;
    writing.own = true;
    put($('about'), `${e.name}: ${e.about}`);
    setText(e.text, `${e.name}.toml`);
  });
  $('text').addEventListener('input', () => {
    writing.own = true;
    clearTimeout(pause);
    pause = setTimeout(judgeText, 250);
  });
  $('take').addEventListener('click', take);
  $('renew').addEventListener('click', () => {
    writing.own = false;
    put($('about'), '');
    renewText();
  });
}
