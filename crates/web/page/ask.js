// Questions after an edit: verdicts at once, solutions and sigmas after a pause.
import { $, put } from './dom.js';
import { LATE, behind, live } from './engine.js';
import { fieldOf, inPageWords } from './fields.js';
import { accepted, clearProblems, failed, problemCount, wrongAt } from './notice.js';
import { copy, source, state } from './scheme.js';
import { askBehind, clearNeeds, endSweep, offerStrip } from './sweep.js';
import { drawOmitted, drawRemedies, drawSentences, drawVerdicts, fade, isStale } from './table.js';
import { verdicts } from './verdicts.js';
import { explainAgain } from './why.js';

let resting = null;

/** Asks for the verdicts on a scheme that has changed since a time in ms. */
export function askVerdicts(began) { verdicts.answered = verdictsNow(began); }

const NOT_JUDGED = 'not judged: what is below is of the scheme before';

async function verdictsNow(began) {
  clearNeeds();
  const before = problemCount(), scheme = copy(state.scheme);
  if (!scheme.position?.length) {
    verdicts.now = null;
    $('verdicts').replaceChildren();
    drawSentences($('sentences'));
    drawRemedies(null);
    fade(false);
    accepted();
    put($('summary'), 'no position yet: add one');
    return;
  }
  const request = { sources: [source(scheme)], solutions: false, omitted: false };
  const late = setTimeout(() => { fade(true); put($('summary'), 'judging: what is below is of the scheme before'); }, LATE);
  const ended = (problem) => {
    fade(true);
    put($('summary'), NOT_JUDGED);
    return failed(problem);
  };
  const found = await live.ask('verdicts', [request], { topic: 'verdicts' }).catch(ended).finally(() => clearTimeout(late));
  if (!found) return;
  fade(!!found.problem);
  if (found.problem) {
    put($('summary'), NOT_JUDGED);
    // fields that were refused before stay marked: what they hold is still in the scheme
    return wrongAt(found.problem, request.sources[0].text);
  }
  accepted();
  // a refusal that came after this question stays on the page
  clearProblems(before);
  verdicts.now = found;
  drawVerdicts();
  offerStrip(found.answer);
  performance.measure('table', { start: began, end: performance.now() });
  if (performance.getEntriesByName('table').length > 2000) performance.clearMeasures();
}

/** Asks for solutions and sigmas after a pause without edits. */
export function askRest() {
  clearTimeout(resting);
  endSweep();
  resting = setTimeout(async () => {
    if (!state.scheme.position?.length) return;
    const asked = JSON.stringify(state.scheme), named = [source(state.scheme)];
    const still = () => asked === JSON.stringify(state.scheme);
    // the sigmas below are shown beside the verdicts, which come first
    await verdicts.answered;
    if (!still() || isStale()) return;
    const run = await behind.ask('call', ['simulate', { sources: named }], { topic: 'sigmas' }).catch(failed);
    if (run && still()) {
      verdicts.sigmasOf = asked;
      verdicts.sigmas = verdicts.omitted = null;
      verdicts.without = run.problem && !run.problem.place ? inPageWords(run.problem.message) : null;
      if (run.problem && (run.problem.place || fieldOf(run.problem, { keys: [] }))) wrongAt(run.problem, named[0].text);
    }
    if (run?.text && still()) {
      const { quantities, requirements, omitted } = JSON.parse(run.text);
      verdicts.omitted = omitted;
      drawOmitted(omitted);
      const missed = new Map(requirements.missed.map((m) => [m.name, m.why]));
      const totals = new Map((omitted?.budgets ?? []).map((b) => [b.unknown, b.total]));
      verdicts.sigmas = new Map(quantities.map((q) => [q.name, { ...q, missed: missed.get(q.name), total: totals.get(q.name) }]));
      verdicts.limited = (omitted?.families ?? []).some((f) => f.uses_up);
      verdicts.requirements = requirements;
    }
    drawVerdicts();
    explainAgain();
    const solved = await behind.ask('verdicts', [{ sources: named }], { topic: 'solutions' }).catch(failed);
    if (solved?.answer && still()) {
      const { answer, math } = solved;
      const found = new Map([...answer.quantities, ...answer.combinations].map((q) => [q.name ?? q.expression, q]));
      verdicts.solutions = { math, find: (name) => found.get(name) };
      verdicts.solutionsOf = asked;
      drawVerdicts();
    }
    askBehind();
  }, 160);
}
