// Files, links, keys; start of the page, and what follows an edit.
import { askRest, askVerdicts } from './ask.js';
import { drawConditions, wireConditions } from './conditions.js';
import { drawFoundOf, drawLimits, wireDesign } from './design.js';
import { $, element } from './dom.js';
import { behind, live } from './engine.js';
import { mendScheme } from './fields.js';
import { clearFine, say, wrong, wrongAgain } from './notice.js';
import { drawPositions, drawSelected, makeSliders, wirePositions } from './positions.js';
import { changed, on, packed, redo, source, state, toToml, undo, unpacked } from './scheme.js';
import { askBehind, wireStrip } from './sweep.js';
import { drawVerdicts } from './table.js';
import { onShow, show, wireTabs } from './tabs.js';
import { openText, renewText, setText, wireText, writing } from './text.js';
import { leaveTour, wireTour } from './tour.js';
import { emphasise } from './verdicts.js';
import { canvasSoon, clearColors, wireView } from './view.js';
import { fadeWhy, wireWhy } from './why.js';

/** Downloads a text as a file. */
function download(text, name, type) {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const a = element('a', { href: url, download: name });
  a.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

async function openFile(file) {
  if (!file) return;
  if (file.size > 4e6) return void say(`${file.name}: ${file.size} bytes; expected a scheme or a model`);
  await openText(await file.text(), file.name);
}

// most characters of a link; a scheme of a thousand positions needs half as many
const LONGEST_LINK = 400_000;

/** Opens the scheme in the page's address. */
async function openLink() {
  const held = new URLSearchParams(location.hash.slice(1)), part = held.get('scheme') ?? held.get('text');
  if (!part) return false;
  if (part.length > LONGEST_LINK) {
    say(`This link holds ${part.length} characters; expected at most ${LONGEST_LINK}: open a file instead.`);
    return false;
  }
  const text = unpacked(part);
  if (text === null) { say('This link is damaged: expected an address that this page made.'); return false; }
  if (held.has('text')) {
    writing.own = true;
    if (text !== $('text').value) setText(text, 'text.toml');
    show('text');
    return false;
  }
  if (text === toToml(state.scheme)) return true;
  return openText(text, 'scheme.toml');
}

function wireFiles() {
  $('open').addEventListener('click', () => $('file').click());
  $('file').addEventListener('change', () => { openFile($('file').files[0]); $('file').value = ''; });
  const isText = () => !$('panel-text').hidden;
  const stem = () => (isText() ? writing.name : state.name).replace(/\.(toml|json)$/i, '') || 'scheme';
  $('save').addEventListener('click', () => (isText() ? download($('text').value, writing.name, 'application/toml')
    : download(toToml(state.scheme), `${stem()}.toml`, 'application/toml')));
  const current = () => (isText() ? { name: writing.name, text: $('text').value } : source(state.scheme));
  const ask = async (command, more) => {
    const said = await behind.ask('call', [command, { sources: [current()], ...more }]).catch((problem) => ({ problem }));
    if (said.problem) { wrong(said.problem); return null; }
    return said.text;
  };
  $('json').addEventListener('click', async () => {
    const text = await ask('analyze', {});
    if (text) download(text, `${stem()}.json`, 'application/json');
  });
  $('report').addEventListener('click', async () => {
    say('Writing the report…', 'fine');
    const text = await ask('report', { command: 'workbench' });
    if (!text) return;
    say('The report is saved: one page, which needs nothing else.', 'fine');
    download(text, `${stem()}.html`, 'text/html');
  });
  $('link').addEventListener('click', () => {
    location.hash = isText() ? `text=${packed($('text').value)}` : `scheme=${packed(toToml(state.scheme))}`;
    navigator.clipboard?.writeText(location.href).then(() => say('The link is in the address bar and copied.', 'fine'),
      () => say('The link is in the address bar.', 'fine'));
  });
  window.addEventListener('hashchange', openLink);
  document.addEventListener('dragover', (e) => { e.preventDefault(); document.body.classList.add('over'); });
  document.addEventListener('dragleave', (e) => { if (!e.relatedTarget) document.body.classList.remove('over'); });
  document.addEventListener('drop', (e) => {
    e.preventDefault();
    document.body.classList.remove('over');
    openFile(e.dataTransfer?.files[0]);
  });
  document.addEventListener('keydown', (e) => {
    if (!(e.ctrlKey || e.metaKey) || e.target.matches('textarea, input:not([type="range"]):not([type="checkbox"])')) return;
    const key = e.key.toLowerCase();
    const what = key === 'z' && !e.shiftKey ? undo : key === 'y' || (key === 'z' && e.shiftKey) ? redo : null;
    if (what) { e.preventDefault(); what(); }
  });
}

/** What follows the events of the scheme, in this order. */
function wireScheme() {
  on('gesture', emphasise);
  on('edit', clearFine);
  on('replaced', mendScheme, leaveTour);
  on('changed', drawFoundOf, drawLimits, fadeWhy, askVerdicts, drawPositions, drawSelected, drawConditions, askRest);
  on('selected', drawPositions, drawSelected, wrongAgain, askBehind);
}

async function begin() {
  $('undo').addEventListener('click', undo);
  $('redo').addEventListener('click', redo);
  makeSliders();
  wirePositions();
  wireConditions();
  wireView();
  wireStrip();
  wireDesign();
  wireText();
  wireWhy();
  wireTour();
  wireFiles();
  wireTabs();
  wireScheme();
  onShow('scheme', canvasSoon, drawVerdicts);
  onShow('text', renewText);
  new ResizeObserver(canvasSoon).observe($('panel-scheme'));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { clearColors(); canvasSoon(); });
  if (!(await openLink())) changed();
  document.documentElement.dataset.ready = 'yes';
}

// for the browser's console; a request holds options and files of a command of the command line
const call = (command, request) => live.ask('call', [command, request]);
window.obsdeg = { call, scheme: () => toToml(state.scheme), ask: live.ask };
begin();
