// Search for the best schemes; the text of schemes and models.

// numbers that limit a search, by their field: option of the request, what is expected, and its test
const LIMITS = {
  'design-slew-rate': ['slew_rate', 'a number of deg/s from 0.001 to 10000', (x) => x >= 0.001 && x <= 1e4],
  'design-max-slew': ['max_slew', 'a number of s', (x) => x >= 0], 'design-max-time': ['max_time', 'a number of s above 0', (x) => x > 0],
};
// fields of a search by what its errors say
const OF_SEARCH = [[/^gimbal|gimbal limit/, 'design-gimbals'], [/^slew_rate|^slews of finite/, 'design-slew-rate'], [/^max_slew/, 'design-max-slew'],
  [/^max_time/, 'design-max-time'], [/no coefficient of this scheme/, 'design-observable'], [/^criterion|^\w+ compares/, 'design-criterion'], [/^meet/, 'design-meet']];
// words of the page for the options that the engine's texts name
const OPTIONS = [[/requirement NAME=SIGMA \(.*\), or \[requirements\] in a scheme file/, 'requirements under Positions, such as D = 0.05, psi = 0.01'],
  [/^worst compares/, 'The largest sigma compares'], [/criterion margin \(over requirements\), or D \(their geometric mean\), or observable with/, 'the criterion margin or determinant, or under Must be observable'],
  [/by slew_rate or the file of candidates/, 'by a slew rate'], [/^gimbal\b/, 'Gimbal limits'], [/^slew_rate\b/, 'Slew rate'], [/^max_slew\b/, 'Longest slew'], [/^max_time\b/, 'Total time'],
  [/^meet\b/, 'Only schemes that meet every requirement'], [/^criterion margin/, 'The criterion margin'], [/\(--bench\)/, '(Bench under Positions)'],
  [/ \(see Gimbals\)/, ' (under Text, path = "gimbals" turns gimbal by gimbal)']];
const inWords = (text) => inPageWords(OPTIONS.reduce((words, [option, name]) => words.replace(option, name), text));

/** Entries of a list in a field. */
const listIn = (id) => $(id).value.split(',').map((t) => t.trim()).filter(Boolean);

/** The request of a search; null if a field holds something wrong, which is then shown there. */
function searched() {
  mendAll([...faults.keys()].filter((id) => id.startsWith('design-')));
  const k = numberIn($('design-k'));
  if (!Number.isInteger(k) || k < 1 || k > 100) fault('design-k', `K: expected a whole number from 1 to 100, found "${$('design-k').value}"`);
  // the candidates under the conditions of the scheme
  const own = copy(state.scheme);
  if (!own.position?.length) own.position = [{ attitude: 'NUE' }];
  // more than are shown: rows of equal figures are folded
  const request = { positions: k, keep: KEPT, conditions_file: { name: state.name, text: toToml(own) }, candidates: $('design-candidates').value, criterion: $('design-criterion').value, meet: $('design-meet').checked };
  for (const [id, [key, expected, holds]] of Object.entries(LIMITS)) {
    const x = numberIn($(id));
    if (x === undefined) continue;
    if (holds(x)) request[key] = x; else fault(id, `${labelOf(id)}: expected ${expected}, found "${$(id).value}"`);
  }
  const limits = limitsIn('design-gimbals'), observable = [...new Set(listIn('design-observable'))];
  if (limits && Object.keys(limits).length) request.gimbal = limitsText(limits).split(', ');
  if (observable.length) request.observable = observable;
  const first = [...faults.keys()].find((id) => id.startsWith('design-'));
  if (first) $(first).focus();
  return first ? null : request;
}

async function search() {
  const request = searched();
  if (!request) return void put($('design-said'), 'Not searched.');
  say('');
  const asked = { conditions: conditions(request), request };
  $('design-stop').disabled = false;
  // the focus stays on a button that works
  if (document.activeElement === $('design-go')) $('design-stop').focus();
  $('design-go').disabled = true;
  // what was found before stays until this search has found something
  searching = true;
  drawFoundOf();
  $('design-progress').removeAttribute('value');
  put($('design-said'), 'searching');
  const began = performance.now();
  let ended = 0;
  const going = (now) => {
    // the bar is indeterminate between two stages
    if (now.total && now.done < now.total) $('design-progress').value = now.done / now.total; else $('design-progress').removeAttribute('value');
    put($('design-said'), `${now.what}: ${now.done}${now.total ? ` of ${now.total}` : ''}${now.best ? `, best so far ${now.best.toPrecision(4)}` : ''}`);
  };
  try {
    const said = await searcher.ask('call', ['design', request], { going });
    if (said.problem) throw said.problem;
    drawFound(JSON.parse(said.text), performance.now() - began, request);
    drawSentences($('found-sentences'), said.sentences.map(inWords));
    foundOf = asked;
    ended = 1;
  } catch (problem) {
    const message = inWords(problem.message ?? String(problem)), id = OF_SEARCH.find(([of]) => of.test(problem.message ?? ''))?.[1];
    // an error about an empty field is about the scheme
    const field = id && ($(id).value !== '' || id === 'design-meet') ? id : null;
    if (field) fault(field, message);
    put($('design-said'), field ? 'Not searched.' : message);
  }
  searching = false;
  drawFoundOf();
  $('design-progress').value = ended;
  $('design-go').disabled = false;
  if (document.activeElement === $('design-stop')) $('design-go').focus();
  $('design-stop').disabled = true;
}

// conditions and request of the listed schemes
let foundOf = null, searching = false;
/** The conditions of a search: those of the scheme, with the limits of the request. */
const conditions = (request) => JSON.stringify({ ...withLimits(copy(state.scheme), request), position: 0, combinations: 0, name: 0, description: 0 });

/** A scheme with the gimbal limits and the slew rate of a search. */
function withLimits(s, request) {
  if (request.gimbal) s.gimbals = { ...s.gimbals, ...gimbalLimits(request.gimbal.join(',')) };
  if (request.slew_rate !== undefined) s.simulation = { ...s.simulation, slew_rate_deg_s: request.slew_rate };
  return s;
}

function drawFoundOf() {
  const old = foundOf !== null && foundOf.conditions !== conditions(foundOf.request);
  for (const id of ['found', 'found-sentences', 'winner']) $(id).classList.toggle('stale', searching || old);
  put($('found-old'), old ? 'The conditions have changed since this search: its figures are of those before.' : '');
}

/** Says which limits hold where the fields of the search are empty. */
function drawLimits() {
  const { gimbals = {}, simulation = {} } = state.scheme;
  const limits = limitsText(gimbals);
  const rate = simulation.slew_rate_deg_s;
  put($('design-limits'), `Where these are empty, the scheme's own hold: ${limits ? `gimbal limits ${limits}` : 'free gimbals'}, ${rate ? `slews at ${rate} deg/s` : 'slews that take no time'}. Slews that take time need inertial carry.`);
}

/** Loads a scheme that was found, with the limits of its search. */
function load(f, number, request) {
  edit((s) => {
    withLimits(s, request);
    s.position = f.angles.map((a) => positionOf(a, s.gimbals));
    // the direction of a half turn is part of the scheme
    f.half_turns.forEach((t) => { s.position[t.to - 1].slew = { about: t.about, angle_deg: 180 }; });
    state.selected = 0;
  });
  show('scheme');
  say(`Scheme ${number} of the search is loaded.`, 'fine');
}

/** Draws the positions of the best scheme. */
function drawWinner(f) {
  const pictures = f.angles.map((text, i) => {
    const angles = text.split(',').map(Number);
    const canvas = element('canvas'), caption = element('figcaption', { textContent: `${i + 1}: ${f.positions[i]}` });
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', `Position ${i + 1} of the best scheme: ${f.positions[i]}`);
    return { angles, canvas, figure: element('figure', {}, canvas, caption) };
  });
  $('winner').replaceChildren(...pictures.map((p) => p.figure));
  drawWinner.again = () => pictures.forEach(({ angles, canvas }) => {
    if (canvas.clientWidth && angles.every(Number.isFinite)) drawPlatform(canvas, matrixOf(angles), { small: true });
  });
  drawWinner.again();
}
drawWinner.again = () => {};

// schemes that are asked for, most rows of different figures, and most schemes in one row
const KEPT = 300, ROWS = 10, EQUAL = 20;

function drawFound(design, took, request) {
  const { search: how, minimum } = design;
  const proven = how.proven ? 'proven best' : 'best found';
  put($('design-said'), `${proven} of ${how.examined} sequences examined in ${(took / 1000).toFixed(1)} s`
    + (minimum?.proven ? `; fewer than ${minimum.positions} of these attitudes do not make ${request.observable ? request.observable.join(', ') : 'every coefficient'} observable` : ''));
  drawWinner(design.found[0]);
  const loads = (f, i) => {
    const button = element('button', { type: 'button', textContent: 'Load' });
    button.setAttribute('aria-label', `Load scheme ${i + 1} as positions`);
    button.addEventListener('click', () => load(f, i + 1, request));
    return button;
  };
  // one row for all schemes of the same figures
  const groups = new Map();
  design.found.forEach((f, i) => {
    const figures = [f.value.toPrecision(4), f.worst ?? '', String(f.worst_degree), f.requirements.stated ? `${f.requirements.met} of ${f.requirements.stated}` : 'none stated', `${(f.total_s / 60).toFixed(0)} min`];
    // the worst coefficient of the same scheme in other axes has another name
    const key = JSON.stringify([figures[0], ...figures.slice(2)]);
    if (!groups.has(key)) groups.set(key, { figures, schemes: [] });
    groups.get(key).schemes.push([f, i]);
  });
  // the last scheme's row goes on where the list is cut
  const last = design.found.length === KEPT ? [...groups.keys()].at(-1) : null;
  // sigmas of coefficients per g are in deg/h/g
  const mixed = how.unit === 'deg/h' && request.criterion === 'worst', unit = mixed ? ' [deg/h, per g]' : how.unit ? ` [${how.unit}]` : '';
  const rows = [...groups].slice(0, ROWS).map(([key, { figures, schemes: [[f, i], ...others] }]) => {
    const listed = others.slice(0, EQUAL).map(([g, j]) => element('p', {}, loads(g, j), ` ${g.positions.join(' ')}`));
    // where as many as were asked for are listed, there may be more
    const count = `${last === key ? 'at least ' : ''}${others.length} more with these figures`;
    const same = element('details', {}, element('summary', { textContent: count }), ...listed,
      ...(others.length > EQUAL ? [element('p', { className: 'soft', textContent: `The first ${EQUAL} of ${others.length}; the command line lists all (--keep).` })] : []));
    return [loads(f, i), element('div', {}, f.positions.join(' '), ...(others.length ? [same] : [])), ...figures];
  });
  $('found').replaceChildren(tableOf(['', 'positions', `criterion${unit}`, 'worst', 'largest degree', 'requirements met', 'total time'], rows));
}

/** Position from the angles of an answer: by letters, unless gimbal limits require these angles. */
function positionOf(text, gimbals) {
  const angles = text.split(',').map(Number);
  const letters = !gimbals && angles.every(Number.isFinite) ? lettersOf(matrixOf(angles)) : null;
  return letters ? { attitude: letters } : { angles_deg: text.split(',').map((t) => (Number.isFinite(Number(t)) ? Number(t) : t.trim())) };
}

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

const writing = { name: 'scheme.toml', timer: null, own: false };

function setText(text, name) {
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
async function openText(text, name) {
  const [read, judged] = await Promise.all([live.ask('toml', [text]), live.ask('call', ['analyze', { sources: [{ name, text }], solutions: false, omitted: false }])])
    .catch((p) => [{ problem: p }, {}]);
  const value = read.value, scheme = value && Array.isArray(value.position) && !value.states;
  if (scheme && !judged.problem) {
    quitTour();
    replace(value, name);
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

function wireDesign() {
  $('design-go').addEventListener('click', search);
  $('panel-design').addEventListener('keydown', (e) => {
    if (e.key === 'Enter' && e.target.matches('input')) { e.preventDefault(); if (!searching) search(); }
  });
  // what is changed there is examined by the next search
  $('panel-design').addEventListener('change', (e) => mend(e.target.id));
  $('design-stop').addEventListener('click', () => searcher.stop());
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
    clearTimeout(writing.timer);
    writing.timer = setTimeout(judgeText, 250);
  });
  $('take').addEventListener('click', take);
  $('renew').addEventListener('click', () => {
    writing.own = false;
    put($('about'), '');
    setText(toToml(state.scheme), state.name);
  });
  listeners.push(drawFoundOf, drawLimits);
}
