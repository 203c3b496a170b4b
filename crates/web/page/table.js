// The table of verdicts: changes, links between indistinguishable unknowns, sigmas against requirements.
import { $, closable, element, put, putMath, putName, putSolution, tableOf, two } from './dom.js';
import { edit, state } from './scheme.js';
import { byName, verdicts } from './verdicts.js';

export const WORDS = { observable: 'observable', inseparable: 'inseparable', not_excited: 'not excited', unobservable: 'not observable', not_seen: 'not seen' };
const verdictOf = (q) => (q.degree === null || q.degree === undefined ? WORDS[q.status] ?? q.status : String(q.degree));

export const isStale = () => $('verdicts').classList.contains('stale');
/** Makes the answers faint if they are of another scheme. */
export function fade(on) {
  for (const id of ['verdicts', 'sentences', 'remedies', 'not-estimated']) $(id).classList.toggle('stale', on);
}

function cell(row, index, className) {
  while (row.children.length <= index) row.append(document.createElement(row.children.length === 1 ? 'th' : 'td'));
  const e = row.children[index];
  if (className && e.className !== className) e.className = className;
  if (e.tagName === 'TH') e.scope = 'row';
  return e;
}

/** The button that shows the name of an unknown in a cell and explains its verdict. */
function whyButton(td) {
  let button = td.querySelector('button.why');
  if (!button) {
    button = element('button', { type: 'button', className: 'why', title: 'Why this verdict, and what changes it' });
    delete td.dataset.of;
    td.replaceChildren(button);
  }
  return button;
}

/** Removes the button from a cell. */
function noWhy(td) {
  if (!td.querySelector('button.why')) return td;
  delete td.dataset.of;
  td.replaceChildren();
  return td;
}

/** Draws the answer about the scheme. */
export function drawVerdicts() {
  const box = $('verdicts'), answer = verdicts.now?.answer;
  if (!answer || isStale()) return;
  let table = box.querySelector('table');
  if (!table) {
    table = element('table', {}, element('thead'), element('tbody'));
    table.tHead.innerHTML = '<tr><td class="links"></td><th scope="col">unknown</th><th scope="col">degree</th><th scope="col">status</th><th scope="col">predicted sigma</th><th scope="col">solution, or why none</th></tr>';
    const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    svg.id = 'links';
    svg.setAttribute('aria-hidden', 'true');
    box.append(table, svg);
  }
  const order = new Map(answer.unknowns.map((n, i) => [n, i]));
  const rows = [...answer.quantities].sort((a, b) => order.get(a.name) - order.get(b.name));
  // one that was found and asked for is listed once
  const asked = new Set((answer.combinations ?? []).filter((c) => c.requested).map((c) => c.expression));
  const combinations = (answer.combinations ?? []).filter((c) => c.requested || !asked.has(c.expression));
  const all = [...rows, ...combinations.map((q) => ({ ...q, combined: true }))];
  const body = table.tBodies[0], old = byName(verdicts.before?.answer);
  while (body.rows.length > all.length) body.lastChild.remove();
  while (body.rows.length < all.length) body.append(document.createElement('tr'));
  let changes = 0;
  all.forEach((q, i) => {
    const tr = body.rows[i], name = q.name ?? q.expression, before = old.get(name);
    const differs = !!before && verdictOf(before) !== verdictOf(q);
    changes += differs;
    const kind = `${q.status ?? 'observable'}${differs ? ' changed' : ''}`;
    if (tr.className !== kind) tr.className = kind;
    if (tr.dataset.name !== name) tr.dataset.name = name;
    cell(tr, 0, 'links');
    const head = cell(tr, 1);
    putName(q.combined ? noWhy(head) : whyButton(head), verdicts.now.math[name], name);
    const degree = cell(tr, 2, 'degree');
    const text = q.degree ?? '\u2013', was = differs ? ` was ${verdictOf(before)}` : '';
    if (degree.textContent !== text + was) degree.replaceChildren(String(text), ...(was ? [element('small', { textContent: was })] : []));
    const status = WORDS[q.status] ?? q.status;
    put(cell(tr, 3, 'status'), q.combined ? `${q.requested ? 'asked for' : 'combination'}, ${q.degree === null ? 'not observable' : status}` : status);
    drawSigma(cell(tr, 4, 'sigma'), q.combined ? null : name);
    drawSolution(cell(tr, 5, 'solution'), q, name);
  });
  drawLinks(rows);
  // sigmas of another scheme are faint until those of this scheme arrive
  const scheme = JSON.stringify(state.scheme);
  table.classList.toggle('old-sigmas', verdicts.sigmasOf !== scheme);
  if (verdicts.sigmasOf !== scheme) drawOmitted(null);
  table.classList.toggle('old-solutions', verdicts.solutionsOf !== scheme);
  const open = rows.filter((q) => q.degree === null).map((q) => q.name);
  const worst = Math.max(0, ...rows.map((q) => q.degree ?? 0));
  const alone = rows.length - open.length, more = answer.rank - alone;
  const together = more > 0 ? ` and ${more} combination${more > 1 ? 's' : ''} of the others` : '';
  const judged = verdicts.sigmasOf === scheme && verdicts.sigmas && verdicts.requirements?.stated ? verdicts.requirements : null;
  const met = judged ? `; requirements ${judged.missed.length ? 'NOT met' : 'met'}, ${judged.met} of ${judged.stated}${!judged.missed.length && verdicts.limited ? ', while no error uses up a margin (Errors that are not estimated)' : ''}` : '';
  put($('summary'), `rank ${answer.rank} of ${answer.unknowns.length}; ${open.length ? `${alone} observable${together}` : `all observable, largest degree ${worst}`}${changes ? `; ${changes} changed` : ''}${met}${verdicts.sigmasOf === scheme && verdicts.without ? `; no sigmas: ${verdicts.without}` : ''}`);
  drawSentences($('sentences'), verdicts.now.sentences);
  drawRemedies(answer.to_resolve);
}

/** Classes of the terms of a family in words: one class for all, or the number of terms in each. */
function classes(f) {
  if (f.no_effect === null) return '\u2013';
  const counts = [[f.no_effect, 'no effect'], [f.silent, 'silent'], [f.terms - f.no_effect - f.silent, 'visible']].filter(([n]) => n);
  return counts.length === 1 ? counts[0][1] : counts.map(([n, word]) => `${n} ${word}`).join(', ');
}

/** Draws the families of errors that are not estimated, and the change of the estimates per unit of each. */
export function drawOmitted(omitted) {
  $('not-estimated').hidden = !omitted;
  if (!omitted) return;
  const used = omitted.families.some((f) => f.uses_up);
  const head = ['family (terms)', 'class', 'worst change', 'of', 'as large as sigma at', 'seen from (3 sigma)', ...(used ? ['uses up a margin at'] : [])];
  const usedUp = (f) => (f.uses_up ? `${two(f.uses_up.size)} ${f.unit} (${f.uses_up.unknown})` : '\u2013');
  const opens = (f) => {
    const open = element('button', { type: 'button', className: 'why', textContent: `${f.family} (${f.terms})`, title: 'What each of its terms changes' });
    open.addEventListener('click', () => drawTerms(omitted, f.family));
    return open;
  };
  const rows = omitted.families.map((f) => [opens(f), classes(f),
    f.worst ? `${Math.abs(f.worst.per_unit).toPrecision(4)} ${f.worst.unit} per ${f.unit}` : '\u2013', f.worst?.unknown ?? '\u2013',
    f.worst_in_sigmas ? `${two(1 / f.worst_in_sigmas)} ${f.unit}` : '\u2013', f.visible_from === null ? '\u2013' : `${two(f.visible_from)} ${f.unit}`, ...(used ? [usedUp(f)] : [])]);
  $('omitted').replaceChildren(tableOf(head, rows));
  if (!$('omitted-terms').hidden) drawTerms(omitted, $('omitted-terms').dataset.family);
}

const perUnit = (x) => `${x.per_unit.toPrecision(3)} ${x.unit}`;

/** Draws the terms of a family of errors that are not estimated: what one unit of each changes. */
function drawTerms(omitted, family) {
  const box = $('omitted-terms'), terms = omitted.terms.filter((t) => t.family === family);
  box.hidden = !terms.length;
  box.dataset.family = family;
  const inUnit = (x, t) => (x === null ? '\u2013' : `${two(x)} ${t.unit}`);
  const stated = terms.some((t) => t.size !== null);
  const rows = terms.map((t) => [t.name, ...(stated ? [inUnit(t.size, t)] : []), t.class?.replace('_', ' ') ?? '\u2013',
    t.sensitivities.map((x) => `${x.unknown} ${perUnit(x)}`).join(', ') || 'nothing', inUnit(t.visible_from, t)]);
  const heads = ['error', ...(stated ? ['stated size'] : []), 'class', `changes per ${terms[0]?.unit ?? 'unit'}: estimate minus truth`, 'seen from (3 sigma)'];
  box.replaceChildren(closable(box, `${family}: each error by itself`), tableOf(heads, rows));
}

/**
 * Errors that are not estimated and change the estimate of an unknown, those of a stated size first, the
 * largest change before; null if there are none.
 */
export function changersOf(omitted, name) {
  const found = (omitted?.terms ?? []).flatMap((t) => t.sensitivities.filter((x) => x.unknown === name).map((x) => [t, x]));
  if (!found.length) return null;
  const effect = ([t, x]) => Math.abs(x.per_unit) * (t.size ?? 0);
  const stated = found.some(([t]) => t.size !== null), sigma = verdicts.sigmas?.get(name)?.predicted_sigma;
  found.sort((a, b) => effect(b) - effect(a));
  const rows = found.map(([t, x]) => [t.name, `${perUnit(x)} per ${t.unit}`, ...(stated ? [t.size === null ? '\u2013' : `${two(t.size)} ${t.unit}`, t.size === null ? '\u2013' : `${two(Math.abs(x.per_unit) * t.size)} ${x.unit}`] : []),
    sigma ? `${two(sigma / Math.abs(x.per_unit))} ${t.unit}` : '\u2013']);
  const heads = ['error', 'change of the estimate', ...(stated ? ['stated size', 'its change'] : []), 'as large as sigma at'];
  const count = rows.length === 1 ? 'One error that is not estimated changes' : `${rows.length} errors that are not estimated change`;
  return element('details', { className: 'changers' }, element('summary', { textContent: `${count} the estimate of ${name}` }), tableOf(heads, rows));
}

const RESOLVE = 'To resolve ';

/** Shows the first lines of the answer: the verdict in a sentence, then what resolves the rest. */
export function drawSentences(e, sentences = []) {
  if (e.dataset.of === sentences.join('\n')) return;
  e.dataset.of = sentences.join('\n');
  const [rest, remedies] = [false, true].map((of) => sentences.filter((text) => text.startsWith(RESOLVE) === of));
  const lines = remedies.map((text) => element('li', { textContent: `${text.slice(RESOLVE.length)}.` }));
  e.replaceChildren(...rest.map((text) => element('p', { textContent: text.endsWith('.') ? text : `${text}.` })),
    ...(lines.length ? [element('h3', { textContent: 'To resolve' }), element('ul', {}, ...lines)] : []));
}

/** A change of a remedy that the page can make: its words, and the edit of the scheme. */
function changeOf(change) {
  if (change.kind === 'attitude') {
    return [`Add ${change.attitude}`, (s) => {
      s.position.push({ attitude: change.attitude });
      state.selected = s.position.length - 1;
    }];
  }
  return change.kind === 'carry' ? [`Take ${change.carry} carry`, (s) => { s.carry = change.carry; }] : null;
}

/** Buttons that make single changes which resolve unknowns. */
export function drawRemedies(resolve) {
  const all = (resolve?.remedies ?? []).filter((r) => r.changes.length === 1).map((r) => [r, changeOf(r.changes[0])]).filter(([, change]) => change);
  const key = JSON.stringify(all);
  if ($('remedies').dataset.of === key) return;
  $('remedies').dataset.of = key;
  $('remedies').replaceChildren(...all.map(([{ resolves, loses }, [words, change]]) => {
    const gains = resolves.map((r) => `${r.name} (degree ${r.degree})`).join(', ');
    const button = element('button', { type: 'button', textContent: words, title: `resolves ${gains}${loses.length ? `; loses ${loses.join(', ')}` : ''}` });
    button.addEventListener('click', () => edit(change));
    return button;
  }));
}

const WHY = { not_excited: 'never moves Z', inseparable: 'moves Z only together with others', not_seen: 'not seen up to the last derivative' };

function drawSolution(td, q, name) {
  const solved = verdicts.solutions?.find(name);
  if (q.degree !== null && q.degree !== undefined) {
    const text = solved?.solution?.text ?? '', math = verdicts.solutions?.math[text], terms = solved?.solution?.terms.length ?? 0;
    if (solved && !solved.solution) return putMath(td, '', 'not written out here: the command line has a symbolic engine too');
    return putSolution(td, math, text, terms);
  }
  const why = q.partners?.length ? `not told from ${q.partners.join(', ')}` : WHY[q.status] ?? '';
  const other = (solved ?? q).elsewhere;
  const where = other && [[other.other_latitudes, 'latitudes'], [other.other_angles, 'angles']].filter(([d]) => d !== null && d !== undefined)
    .map(([d, what]) => `degree ${d} at other ${what}`).join('; ');
  putMath(td, '', where ? `${why}; ${where}` : why);
}

function drawSigma(td, name) {
  const s = name && verdicts.sigmas?.get(name);
  const key = s ? `${s.predicted_sigma} ${s.total} ${s.required_sigma} ${s.missed}` : '';
  if (td.dataset.of === key) return;
  td.dataset.of = key;
  if (!s) return td.replaceChildren();
  // the requirement is compared with the total where a bench is stated, else with sigma
  const sigma = s.predicted_sigma, decides = s.total ?? sigma;
  const total = s.total !== undefined && two(s.total) !== two(sigma) ? `, total ${two(s.total)}` : '';
  const said = sigma === null ? 'not determined' : `${two(sigma)}${total} ${s.unit}`;
  if (s.required_sigma === null || sigma === null) {
    td.title = s.required_sigma === null ? 'no requirement is stated' : `misses its requirement, ${s.required_sigma} ${s.unit}: the samples do not determine it`;
    return td.replaceChildren(said);
  }
  td.title = '';
  const ratio = decides / s.required_sigma;
  // three decades, two of them below the requirement
  const part = Math.max(0.01, Math.min(1, (Math.log10(ratio) + 2) / 3));
  const over = s.missed !== undefined;
  const bar = element('i'), box = element('span', { className: `against${over ? ' over' : ''}` }, bar, element('b'));
  bar.style.width = `${part * 100}%`;
  box.setAttribute('role', 'img');
  box.setAttribute('aria-label', `${over ? 'misses' : 'meets'} its requirement: ${ratio.toPrecision(2)} times`);
  box.title = `required ${s.required_sigma} ${s.unit}`;
  td.replaceChildren(box, said);
}

/** Draws arcs beside the table between indistinguishable unknowns. */
function drawLinks(rows) {
  const svg = $('links'), body = $('verdicts').querySelector('tbody');
  const places = rows.map((_, i) => body.rows[i].offsetTop + body.rows[i].offsetHeight / 2);
  const index = new Map(rows.map((q, i) => [q.name, i])), groups = new Map();
  for (const q of rows) {
    if (q.status === 'inseparable' && q.partners.length) groups.set([q.name, ...q.partners].sort().join(' '), [q.name, ...q.partners]);
  }
  const key = JSON.stringify([[...groups.keys()], places]);
  if (svg.dataset.of === key) return;
  svg.dataset.of = key;
  const height = body.offsetTop + body.offsetHeight;
  svg.setAttribute('height', height);
  svg.setAttribute('width', 34);
  const make = (tag, attributes) => {
    const e = document.createElementNS('http://www.w3.org/2000/svg', tag);
    for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
    return e;
  };
  const parts = [];
  [...groups.values()].forEach((names, g) => {
    const ys = names.filter((n) => index.has(n)).map((n) => places[index.get(n)]).sort((a, b) => a - b);
    ys.forEach((y) => parts.push(make('circle', { cx: 29, cy: y, r: 2.6 })));
    for (let i = 1; i < ys.length; i++) {
      const bend = 29 - Math.min(25, 9 + (ys[i] - ys[i - 1]) / 8 + g * 3);
      parts.push(make('path', { d: `M29 ${ys[i - 1]} C${bend} ${ys[i - 1]} ${bend} ${ys[i]} 29 ${ys[i]}` }));
    }
  });
  svg.replaceChildren(...parts);
}
