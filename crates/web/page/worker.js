// The engine in a thread. Messages in: { id, kind, args }; out: { id, out }, { id, going } and { id, crash }.
let asked = 0;

// called by the engine with its progress
function going(now) {
  postMessage({ id: asked, going: JSON.parse(now) });
  return true;
}

// 13 bits from two digits to base 91, both least significant first; no digit is `"`, `<` or the backslash
function bytes(text) {
  const start = text.indexOf(' ') + 1, out = new Uint8Array(Number(text.slice(0, start)));
  const digit = (i) => {
    const c = text.charCodeAt(i);
    return c - 33 - (c > 34) - (c > 60) - (c > 92);
  };
  let held = 0, bits = 0, at = 0;
  for (let i = start; i < text.length; i += 2) {
    held |= (digit(i) + 91 * digit(i + 1)) << bits;
    bits += 13;
    for (; bits >= 8; bits -= 8, held >>= 8) out[at++] = held & 255;
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
