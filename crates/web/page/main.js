// Tabs, files, links, keys; start of the page.

const TABS = ['scheme', 'design', 'text'];

function show(tab) {
  for (const t of TABS) {
    const on = t === tab;
    $(`tab-${t}`).setAttribute('aria-selected', on);
    $(`tab-${t}`).tabIndex = on ? 0 : -1;
    $(`panel-${t}`).hidden = !on;
  }
  if (tab === 'text' && !writing.own) setText(toToml(state.scheme), state.name);
  if (tab === 'scheme') { canvasSoon(); drawVerdicts(); }
}

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

function wireTabs() {
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

async function begin() {
  $('undo').addEventListener('click', undo);
  $('redo').addEventListener('click', redo);
  makeSliders();
  wireConditions();
  wireView();
  wireStrip();
  wireDesign();
  wireWhy();
  wireTour();
  wireFiles();
  wireTabs();
  listeners.push(askVerdicts, drawPositions, drawSelected, drawConditions, askRest);
  new ResizeObserver(canvasSoon).observe($('panel-scheme'));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { palette.clear(); canvasSoon(); });
  if (!(await openLink())) changed();
  document.documentElement.dataset.ready = 'yes';
}

// commands for the browser's console
window.obsdeg = { call, scheme: () => toToml(state.scheme), ask: live.ask };
begin();
