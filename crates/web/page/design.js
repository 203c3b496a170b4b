// The search for the best schemes.
import { gimbalLimits, limitsIn, limitsText } from './conditions.js';
import { $, element, put, tableOf } from './dom.js';
import { searcher } from './engine.js';
import { fault, inPageWords, labelOf, mend, mendAll, numberIn, searchFaults } from './fields.js';
import { matrixOf } from './geometry.js';
import { say } from './notice.js';
import { copy, edit, positionOf, source, state } from './scheme.js';
import { drawSentences } from './table.js';
import { show } from './tabs.js';
import { drawPlatform, onDraw } from './view.js';

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
  mendAll(searchFaults());
  const k = numberIn($('design-k'));
  if (!Number.isInteger(k) || k < 1 || k > 100) fault('design-k', `K: expected a whole number from 1 to 100, found "${$('design-k').value}"`);
  // the candidates under the conditions of the scheme
  const own = copy(state.scheme);
  if (!own.position?.length) own.position = [{ attitude: 'NUE' }];
  // more than are shown: rows of equal figures are folded
  const request = { positions: k, keep: KEPT, conditions_file: source(own), candidates: $('design-candidates').value,
    criterion: $('design-criterion').value, meet: $('design-meet').checked };
  for (const [id, [key, expected, holds]] of Object.entries(LIMITS)) {
    const x = numberIn($(id));
    if (x === undefined) continue;
    if (holds(x)) request[key] = x; else fault(id, `${labelOf(id)}: expected ${expected}, found "${$(id).value}"`);
  }
  const limits = limitsIn('design-gimbals'), observable = [...new Set(listIn('design-observable'))];
  if (limits && Object.keys(limits).length) request.gimbal = limitsText(limits).split(', ');
  if (observable.length) request.observable = observable;
  const [first] = searchFaults();
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

export function drawFoundOf() {
  const old = foundOf !== null && foundOf.conditions !== conditions(foundOf.request);
  for (const id of ['found', 'found-sentences', 'winner']) $(id).classList.toggle('stale', searching || old);
  put($('found-old'), old ? 'The conditions have changed since this search: its figures are of those before.' : '');
}

/** Says which limits hold where the fields of the search are empty. */
export function drawLimits() {
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

// draws the pictures of the best scheme again
let drawPictures = () => {};

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
  drawPictures = () => pictures.forEach(({ angles, canvas }) => {
    if (canvas.clientWidth && angles.every(Number.isFinite)) drawPlatform(canvas, matrixOf(angles), { small: true });
  });
  drawPictures();
}

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

export function wireDesign() {
  onDraw(() => drawPictures());
  $('design-go').addEventListener('click', search);
  $('panel-design').addEventListener('keydown', (e) => {
    if (e.key === 'Enter' && e.target.matches('input')) { e.preventDefault(); if (!searching) search(); }
  });
  // what is changed there is examined by the next search
  $('panel-design').addEventListener('change', (e) => mend(e.target.id));
  $('design-stop').addEventListener('click', () => searcher.stop());
}
