// The engine in a thread. Messages in: { id, kind, args }; out: { id, out }, { id, going } and { id, crash }.
let asked = 0;

// called by the engine with its progress
function going(now) {
  postMessage({ id: asked, going: JSON.parse(now) });
  return true;
}

// four bytes from five digits to base 85, both least significant first
function bytes(text) {
  const start = text.indexOf(' ') + 1, out = new Uint8Array(Number(text.slice(0, start)));
  for (let i = start, at = 0; i < text.length; i += 5, at += 4) {
    let number = 0;
    for (let k = 4; k >= 0; k--) {
      const c = text.charCodeAt(i + k);
      number = number * 85 + (c === 125 ? 92 : c === 126 ? 60 : c) - 40;
    }
    for (let k = 0; k < 4 && at + k < out.length; k++) out[at + k] = Math.floor(number / 256 ** k) % 256;
  }
  return out;
}

const typeset = new Map();
function mathOf(expression) {
  if (!typeset.has(expression)) typeset.set(expression, obsdeg_web.mathml(expression));
  return typeset.get(expression);
}

const cut = (number) => (Number(number) < 1e-6 ? number : String(Number(Number(number).toPrecision(6))));
const readable = (term) => ({ ...term, coefficient: term.coefficient.replace(/\d+\.\d{6,}/g, cut) });

const KINDS = {
  // starts the engine: packed, or as a module that another worker compiled
  start({ unpack, engine, module }) {
    if (!module) {
      obsdeg_unpack.initSync({ module: bytes(unpack) });
      module = new WebAssembly.Module(obsdeg_unpack.unpack(bytes(engine)));
    }
    obsdeg_web.initSync({ module });
    return { module };
  },
  call: (command, request) => JSON.parse(obsdeg_web.call(command, JSON.stringify(request))),
  toml: (text) => JSON.parse(obsdeg_web.toml_as_json(text)),
  // an answer with its formulas, whose decimals are shortened
  verdicts(request) {
    const said = KINDS.call('analyze', request);
    if (said.problem) return said;
    const answer = JSON.parse(said.text), math = {};
    const platform = answer.schema.startsWith('obsdeg.analysis/');
    const rows = [...(answer.quantities ?? []), ...(answer.combinations ?? [])];
    for (const row of rows) {
      const name = row.name ?? row.expression;
      if (name) math[name] = mathOf(name);
      const terms = row.solution?.terms;
      if (platform && terms?.length) math[row.solution.text] = obsdeg_web.solution_mathml(JSON.stringify(terms.map(readable)));
    }
    return { answer, math, text: said.text, sentences: said.sentences };
  },
};

onmessage = ({ data: { id, kind, args } }) => {
  asked = id;
  try {
    postMessage({ id, out: KINDS[kind](...args) });
  } catch (e) {
    postMessage({ id, crash: String(e) });
  }
};
