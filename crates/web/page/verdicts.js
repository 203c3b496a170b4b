// Answers about the scheme: `ask.js` fills them in, and all that shows them reads them.

// last answer, the one that its changes are compared with (null if there is none), and the end of the last question;
// figures by unknown or the reason why there are none, with requirements and errors that are not estimated; solutions;
// the schemes, as JSON, of figures and of solutions
export const verdicts = {
  now: null, before: null, answered: null, sigmas: null, without: null, requirements: null, omitted: null, limited: false,
  solutions: null, sigmasOf: null, solutionsOf: null,
};

/** Makes the verdicts of the table those that later changes are compared with. */
export function emphasise() { verdicts.before = verdicts.now ?? verdicts.before; }

/** Unknowns of an answer by name. */
export const byName = (answer) => new Map((answer?.quantities ?? []).map((q) => [q.name, q]));
