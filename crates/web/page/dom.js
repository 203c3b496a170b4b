// Elements of the page; numbers in its texts.

export const $ = (id) => document.getElementById(id);

export function element(tag, properties = {}, ...children) {
  const e = Object.assign(document.createElement(tag), properties);
  e.append(...children);
  return e;
}

export const put = (e, text) => { if (e.textContent !== text) e.textContent = text; };

export function putMath(e, math, text) {
  const key = math || text;
  if (e.dataset.of === key) return;
  e.dataset.of = key;
  if (math) e.innerHTML = math; else e.replaceChildren(text.length > 60 ? element('code', { textContent: text }) : text);
}

/** A name as a formula, and as a text for screen readers. */
export function putName(e, math, name) {
  if (e.dataset.of === (math || name)) return;
  putMath(e, math, name);
  if (!math) return;
  e.firstElementChild.setAttribute('aria-hidden', 'true');
  e.append(element('span', { className: 'unseen', textContent: name }));
}

// number of terms from which a solution is folded
const SHORT = 8;

/** A solution as a formula, folded where it has many terms. */
export function putSolution(e, math, text, terms) {
  if (terms <= SHORT) return putMath(e, math, text);
  if (e.dataset.of === text) return;
  e.dataset.of = text;
  const inner = element('div'), fold = element('details', {}, element('summary', { textContent: `${terms} terms` }), inner);
  fold.addEventListener('toggle', () => putMath(inner, math, text), { once: true });
  e.replaceChildren(fold);
}

export function tableOf(heads, rows, caption = '') {
  const table = element('table', {}, ...(caption ? [element('caption', { textContent: caption })] : []), element('thead'), element('tbody'));
  table.tHead.append(element('tr', {}, ...heads.map((h) => element('th', { scope: 'col', textContent: h }))));
  for (const row of rows) {
    const cells = row.map((x) => (x instanceof Node ? element('td', {}, x) : element('td', { textContent: x ?? '' })));
    table.tBodies[0].append(element('tr', {}, ...cells));
  }
  return table;
}

/** The heading of a box, with a button that closes it. */
export function closable(box, heading) {
  const close = element('button', { type: 'button', textContent: 'Close' });
  close.addEventListener('click', () => { box.hidden = true; box.replaceChildren(); });
  return element('div', { className: 'titled' }, element('h3', { textContent: heading }), close);
}

/** Two significant digits, without an exponent for large numbers. */
export const two = (x) => (x >= 100 && x < 1e7 ? String(Number(x.toPrecision(2))) : x.toPrecision(2));

/** A number from a text; NaN if the text is none. */
export const finite = (text) => {
  const plain = text?.trim().replace('\u2212', '-') ?? '', x = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
  return Number.isFinite(x) ? x : NaN;
};
