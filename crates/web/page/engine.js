// Workers that run the engine. Of a worker one question is under way at a time; of a lane only the latest waits.

const DATA = JSON.parse(document.getElementById('data').textContent);
const SOURCE = URL.createObjectURL(new Blob([DATA.worker], { type: 'text/javascript' }));
// compiled once, by the first worker that is ready
let compiled = null;

/** A worker that is started when it is first asked, and again after a crash or a stop. */
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
    // what was to start the old worker must not start the new one
    const starts = waiting.findIndex((w) => w.kind === 'start');
    if (starts >= 0) waiting.splice(starts, 1);
    return left;
  }

  function crashed(reason) {
    end()?.reject({ kind: 'internal', message: `The engine stopped (${reason}) and was started again.` });
    step();
  }

  return {
    /** Asks; null where a later question of the same lane came first. */
    ask(kind, args, { lane, going } = {}) {
      return new Promise((resolve, reject) => {
        if (lane) {
          for (let i = waiting.length - 1; i >= 0; i--) {
            if (waiting[i].lane === lane) waiting.splice(i, 1)[0].resolve(null);
          }
        }
        waiting.push({ kind, args, lane, going, resolve, reject });
        step();
      });
    },
    /** Forgets what waits in lanes that begin so. */
    forget(lane) {
      for (let i = waiting.length - 1; i >= 0; i--) {
        if (waiting[i].lane?.startsWith(lane)) waiting.splice(i, 1)[0].resolve(null);
      }
    },
    /** Ends what is under way. */
    stop() {
      end()?.reject({ kind: 'interrupted', message: 'Stopped.' });
      step();
    },
  };
}

// what follows every input, and what may take its time
const live = makeEngine(), behind = makeEngine(), searcher = makeEngine();

/** A command as the command line knows it. */
async function call(command, request) {
  return live.ask('call', [command, request]);
}
