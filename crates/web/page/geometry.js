// Attitudes. C = Mx(alpha) My(beta) Mz(gamma), passive; its columns are X_p, Y_p, Z_p in North, Up, East.

export const RAD = Math.PI / 180;
/** Names of the Euler angles, in their order. */
export const AXES = ['alpha', 'beta', 'gamma'];
export const LETTERS = { N: [1, 0, 0], S: [-1, 0, 0], U: [0, 1, 0], D: [0, -1, 0], E: [0, 0, 1], W: [0, 0, -1] };

export function matrixOf([alpha, beta, gamma]) {
  const [[sa, ca], [sb, cb], [sg, cg]] = [alpha, beta, gamma].map((x) => [Math.sin(x * RAD), Math.cos(x * RAD)]);
  const inner = [[cb * cg, cb * sg, -sb], [-sg, cg, 0], [sb * cg, sb * sg, cb]];
  const row = (a, b) => inner[1].map((x, j) => a * x + b * inner[2][j]);
  return [inner[0], row(ca, sa), row(-sa, ca)];
}

export function anglesOf(c) {
  const beta = Math.asin(Math.max(-1, Math.min(1, -c[0][2])));
  const level = Math.hypot(c[0][0], c[0][1]) < 1e-9;
  const alpha = level ? Math.atan2(-c[2][1], c[1][1]) : Math.atan2(c[1][2], c[2][2]);
  const gamma = level ? 0 : Math.atan2(c[0][1], c[0][0]);
  return [alpha, beta, gamma].map((x) => Math.round((x / RAD) * 1e9) / 1e9 + 0);
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** The matrix of three letters such as `NUE`; null if the letters are no right-handed axes. */
export function matrixOfLetters(letters) {
  const axes = [...letters.toUpperCase()].map((l) => LETTERS[l]);
  if (axes.length !== 3 || axes.some((a) => !a)) return null;
  const z = cross(axes[0], axes[1]);
  if (z.some((x, i) => x !== axes[2][i])) return null;
  return [0, 1, 2].map((i) => axes.map((a) => a[i]));
}

/** Letters of the axes' directions, such as `NUE`; null if an axis is not along one of the six. */
export function lettersOf(c) {
  const name = (j) => Object.entries(LETTERS).find(([, v]) => v.every((x, i) => Math.abs(x - c[i][j]) < 1e-9))?.[0];
  const letters = [0, 1, 2].map(name);
  return letters.every(Boolean) ? letters.join('') : null;
}

const transpose = (m) => m[0].map((_, j) => m.map((row) => row[j]));
export const times = (a, b) => a.map((row) => b[0].map((_, j) => row.reduce((sum, x, k) => sum + x * b[k][j], 0)));

/** Axis (in North, Up, East) and angle in rad of the shortest turn from one attitude to another. */
export function turnBetween(from, to) {
  const r = times(to, transpose(from));
  const angle = Math.acos(Math.max(-1, Math.min(1, (r[0][0] + r[1][1] + r[2][2] - 1) / 2)));
  if (angle < 1e-9) return { axis: [0, 1, 0], angle: 0 };
  if (Math.PI - angle > 1e-6) {
    const s = 2 * Math.sin(angle);
    return { axis: [(r[2][1] - r[1][2]) / s, (r[0][2] - r[2][0]) / s, (r[1][0] - r[0][1]) / s], angle };
  }
  // half a turn: r + 1 = 2 u u^T
  const i = [0, 1, 2].sort((a, b) => r[b][b] - r[a][a])[0];
  const u = r.map((row, k) => row[i] + (k === i ? 1 : 0));
  const length = Math.hypot(...u);
  return { axis: u.map((x) => x / length), angle };
}

/** The turn by an angle about an axis (Rodrigues). */
export function turn([x, y, z], angle) {
  const [s, c] = [Math.sin(angle), Math.cos(angle)], t = 1 - c;
  return [[t * x * x + c, t * x * y - s * z, t * x * z + s * y],
    [t * x * y + s * z, t * y * y + c, t * y * z - s * x],
    [t * x * z - s * y, t * y * z + s * x, t * z * z + c]];
}

/** An angle in degrees as the sliders have it, from -180 to 180. */
export const withinTurn = (angle) => (Math.abs(angle) <= 180 ? angle : angle - 360 * Math.round(angle / 360));
