// Workers that run the engine. A worker answers one question at a time. Only the latest question of a topic
// waits.

export const DATA = JSON.parse(document.getElementById('data').textContent);
const SOURCE = URL.createObjectURL(new Blob([DATA.worker], { type: 'text/javascript' }));
// engine compiled by the first worker that is ready, for all others
let compiled = null;

/** A worker that starts at the first question, and again after a crash or a stop. */
function makeEngine() {
  let worker = null, current = null, next = 0;
  const waiting = [];

  function start() {
    worker = new Worker(SOURCE);
    worker.onmessage = ({ data }) => hear(data);
    worker.onerror = (e) => { e.preventDefault(); crashed(e.message || 'no reason given'); };
    const args = compiled ? { module: compiled } : { unpack: DATA.unpack, engine: DATA.engine };
    const ready = ({ module }) => { compiled = module; };
    waiting.unshift({ kind: 'start', args: [args], resolve: ready, reject: () => {} });
  }

  function step() {
    if (current || !waiting.length) return;
    if (!worker) start();
    current = waiting.shift();
    current.id = ++next;
    worker.postMessage({ id: current.id, kind: current.kind, args: current.args });
  }

  function hear({ id, out, going, crash }) {
    if (!current || id !== current.id) return;
    if (going) return void current.going?.(going);
    if (crash !== undefined) return crashed(crash);
    const { resolve } = current;
    current = null;
    resolve(out);
    step();
  }

  function end() {
    worker?.terminate();
    worker = null;
    const left = current;
    current = null;
    // drops the start message of the ended worker: the next worker gets its own
    const starts = waiting.findIndex((w) => w.kind === 'start');
    if (starts >= 0) waiting.splice(starts, 1);
    return left;
  }

  function crashed(reason) {
    end()?.reject({ kind: 'internal', message: `The engine stopped (${reason}) and was started again.` });
    step();
  }

  return {
    /** Asks; resolves to null if a later question of the same topic replaces this one. */
    ask(kind, args, { topic, going } = {}) {
      return new Promise((resolve, reject) => {
        if (topic) {
          for (let i = waiting.length - 1; i >= 0; i--) {
            if (waiting[i].topic === topic) waiting.splice(i, 1)[0].resolve(null);
          }
        }
        waiting.push({ kind, args, topic, going, resolve, reject });
        step();
      });
    },
    /** Drops waiting questions of topics that begin with `topic`. */
    forget(topic) {
      for (let i = waiting.length - 1; i >= 0; i--) {
        if (waiting[i].topic?.startsWith(topic)) waiting.splice(i, 1)[0].resolve(null);
      }
    },
    /** Ends the current question. */
    stop() {
      end()?.reject({ kind: 'interrupted', message: 'Stopped.' });
      step();
    },
  };
}

// workers for questions after every input, for slow questions, and for searches
export const live = makeEngine();
export const behind = makeEngine();
export const searcher = makeEngine();

/** Time in ms after which an answer that is not there yet makes the one before faint. */
export const LATE = 400;
