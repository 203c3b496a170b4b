// The tabs of the page.
import { $ } from './dom.js';

const TABS = ['scheme', 'design', 'text'];
const listeners = Object.fromEntries(TABS.map((t) => [t, []]));
/** Adds functions that are called when a tab is shown. */
export const onShow = (tab, ...added) => listeners[tab].push(...added);

export function show(tab) {
  for (const t of TABS) {
    const on = t === tab;
    $(`tab-${t}`).setAttribute('aria-selected', on);
    $(`tab-${t}`).tabIndex = on ? 0 : -1;
    $(`panel-${t}`).hidden = !on;
  }
  listeners[tab].forEach((listener) => listener());
}

export function wireTabs() {
  for (const t of TABS) $(`tab-${t}`).addEventListener('click', () => show(t));
  $('tabs').addEventListener('keydown', (e) => {
    const at = TABS.findIndex((t) => $(`tab-${t}`).getAttribute('aria-selected') === 'true'), last = TABS.length - 1;
    const to = { ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: last }[e.key];
    if (to === undefined) return;
    e.preventDefault();
    const next = TABS[(to + TABS.length) % TABS.length];
    show(next);
    $(`tab-${next}`).focus();
  });
}
