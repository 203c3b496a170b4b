// Search for the best schemes of the cardinal attitudes; the text of schemes and models.

async function search() {
  const k = Number($('design-k').value);
  if (!Number.isInteger(k) || k < 1) return void refuse(`K: expected a whole number from 1, found "${$('design-k').value}"`);
  say('');
  // the 24 cardinal attitudes under the conditions of the scheme
  const own = copy(state.scheme);
  if (!own.position?.length) own.position = [{ attitude: 'NUE' }];
  const request = { positions: k, conditions_file: { name: state.name, text: toToml(own) }, criterion: $('design-criterion').value };
  const wanted = $('design-observable').value.split(',').map((t) => t.trim()).filter(Boolean);
  if (wanted.length) request.observable = wanted;
  $('design-go').disabled = true;
  $('design-stop').disabled = false;
  $('found').replaceChildren();
  foundOf = null;
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
    drawFound(JSON.parse(said.text), performance.now() - began, wanted);
    foundOf = conditions();
    ended = 1;
  } catch (problem) {
    put($('design-said'), problem.message ?? String(problem));
  }
  $('design-progress').value = ended;
  $('design-go').disabled = false;
  $('design-stop').disabled = true;
}

// conditions of the listed schemes
let foundOf = null;
const conditions = () => JSON.stringify({ ...state.scheme, position: 0, combinations: 0, name: 0, description: 0 });

function drawFoundOf() {
  const old = foundOf !== null && foundOf !== conditions();
  $('found').classList.toggle('stale', old);
  put($('found-old'), old ? 'The conditions have changed since this search: its figures are of those before.' : '');
}

function drawFound(design, took, wanted) {
  const { search: how, minimum } = design;
  const proven = how.proven ? 'proven best' : 'best found';
  put($('design-said'), `${proven} of ${how.examined} sequences examined in ${(took / 1000).toFixed(1)} s`
    + (minimum?.proven ? `; fewer than ${minimum.positions} of these attitudes do not make ${wanted.length ? wanted.join(', ') : 'every coefficient'} observable` : ''));
  const rows = design.found.map((f, i) => {
    const load = element('button', { type: 'button', textContent: 'Load' });
    load.setAttribute('aria-label', `Load scheme ${i + 1} as positions`);
    load.addEventListener('click', () => {
      edit((s) => {
        s.position = f.angles.map((a) => positionOf(a, s.gimbals));
        // the direction of a half turn is part of the scheme
        f.half_turns.forEach((t) => { s.position[t.to - 1].slew = { about: t.about, angle_deg: 180 }; });
        state.selected = 0;
      });
      show('scheme');
      say(`Scheme ${i + 1} of the search is loaded.`, 'fine');
    });
    return [load, f.positions.join(' '), `${f.value.toPrecision(4)} ${how.unit ?? ''}`, f.worst ?? '', String(f.worst_degree), f.requirements.stated ? `${f.requirements.met} of ${f.requirements.stated}` : 'none stated'];
  });
  $('found').replaceChildren(tableOf(['', 'positions', 'criterion', 'worst', 'largest degree', 'requirements met'], rows));
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
  const found = await live.ask('verdicts', [{ sources: [{ name: writing.name, text }] }], { lane: 'text' }).catch((p) => ({ problem: p }));
  if (!found || text !== $('text').value) return;
  const area = $('text'), { problem, answer, math, sentences } = found;
  area.setAttribute('aria-invalid', problem ? 'true' : 'false');
  $('text-problem').replaceChildren();
  $('text-why').hidden = true;
  $('text-why').replaceChildren();
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
    $('text-verdicts').replaceChildren();
    return;
  }
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
  parts.unshift(...(sentences ?? []).map((text) => element('p', { textContent: `${text}.` })));
  if (answer.quantities.some((q) => q.degree !== null && !q.solution)) {
    parts.push(element('p', { className: 'soft', textContent: 'Solutions that are not here need the symbolic engine, which the command line has.' }));
  }
  const list = (title, items) => items?.length && parts.push(element('h3', { textContent: title }), element('ul', {}, ...items.map((t) => element('li', { textContent: t }))));
  list('Symmetries: these changes move no output', answer.symmetries?.map((s) => s.words));
  list('Other directions', answer.other_directions?.map((d) => d.words ?? JSON.stringify(d)));
  list('Invariants', answer.invariants?.map((i) => `${i.expression}${i.degree === null ? '' : `, degree ${i.degree}`}`));
  list('Combinations', answer.combinations?.map((i) => `${i.expression ?? i.name}${i.degree === null ? '' : `, degree ${i.degree}`}`));
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
  if (await openText($('text').value, name)) {
    writing.own = false;
    show('scheme');
  } else if ($('text').getAttribute('aria-invalid') !== 'true') refuse(`${name} is a model; expected a scheme, with [[position]] tables`);
}

/** Opens a text: a scheme as positions, anything else in the editor. */
async function openText(text, name) {
  const [read, judged] = await Promise.all([live.ask('toml', [text]), live.ask('call', ['analyze', { sources: [{ name, text }], solutions: false, omitted: false }])])
    .catch((p) => [{ problem: p }, {}]);
  const value = read.value, scheme = value && Array.isArray(value.position) && !value.states;
  if (scheme && !judged.problem) {
    replace(value, name);
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
  listeners.push(drawFoundOf);
}
