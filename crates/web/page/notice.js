// The message above all, and refusals of the scheme by the engine, which are shown at their fields or there.
import { $ } from './dom.js';
import { OF_POSITION, fault, faultOf, fieldOf, inPageWords, keyAt, mendKind } from './fields.js';
import { nameOfPosition, state } from './scheme.js';

let problems = 0;
// the last refusal of the scheme by the engine, and the text that it is of; null for a scheme that was judged
let refused = null;

/**
 * Shows a message, also to screen readers. `kind`: `fine`, or `unseen` where the page shows the text anyway.
 */
export function say(text, kind = '') {
  delete $('notice').dataset.engine;
  $('notice').className = kind;
  $('notice').textContent = text;
}

/** Clears a message that is no problem. */
export function clearFine() {
  if ($('notice').className === 'fine') say('');
}

/** Shows an error above all; `engine` marks a refusal of the scheme, which the next answer replaces. */
export function wrong(problem, engine = false) {
  $('notice').dataset.problem = ++problems;
  say(inPageWords(problem.message));
  if (engine) $('notice').dataset.engine = 'yes';
}

function clearNotice() {
  say('');
  delete $('notice').dataset.problem;
}

/** Number of problems that were shown so far. */
export const problemCount = () => problems;
/** Clears the notice if it is one of the first `count` problems. */
export function clearProblems(count) {
  if (Number($('notice').dataset.problem) <= count) clearNotice();
}

/** Shows why a question has no answer, unless it was stopped; null. */
export function failed(problem) {
  if (problem.kind !== 'interrupted') wrong(problem);
  return null;
}

/** Shows an error of the engine at the field of its value, or above all if it has no field here. */
export function wrongAt(problem, text) {
  refused = { problem, text };
  const { place } = problem, at = place ? keyAt(text, place.start) : { position: null, keys: [], index: 0 };
  const id = fieldOf(problem, at), here = !OF_POSITION.includes(id) || at.position === null || at.position === state.selected;
  if (!id || !here) {
    const where = at.position === null ? '' : `${nameOfPosition(state.scheme.position[at.position], at.position)}: `;
    return wrong({ message: `${where}${problem.message}` }, true);
  }
  if ($('notice').dataset.engine) clearNotice();
  // what is typed there and was refused before comes first
  if (faultOf(id) !== 'own') fault(id, inPageWords(problem.message), 'engine');
}

/** Shows the last refusal again, for the position that is selected now. */
export function wrongAgain() {
  if (refused) wrongAt(refused.problem, refused.text);
}

/** Removes the last refusal: the scheme was judged, or has no position. */
export function accepted() {
  refused = null;
  mendKind('engine');
}
