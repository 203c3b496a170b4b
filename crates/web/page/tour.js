// Five steps that show the use of the page; each sets its scheme.

const SIX = [[10, 25, 40], [130, -50, 70], [-95, 33, -160], [60, 80, 15], [-20, -70, 110], [170, 15, -75]].map((angles_deg) => ({ angles_deg }));
const TOUR = [
  ['Two positions do not show the azimuth',
    'p1 and p2 are upside down of each other. Z sees the tilts psi_x and psi_z at once (degree 0). The azimuth psi_y is linked with D_FZ: it shows only by the earth rate that it leads into the level axis, and a drift of that axis looks the same at both positions.',
    { carry: 'platform', position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [180, 0, 0] }] }],
  ['A position whose vertical axis is another makes psi_y observable',
    'Now p2 has another axis of the platform along the vertical (alpha 90 instead of 180). Carried with the platform, what was azimuth at p1 is partly tilt at p2, and tilt is seen at once: psi_y has degree 0. Drag alpha of p2: every angle does it but 0 and \u00b1180 degrees, the marks under the slider. A turn about the vertical alone (alpha 0, beta 90) brings psi_y only through the earth rate, with degree 1.',
    { carry: 'platform', position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [90, 0, 0] }] }, 1],
  ['At the pole the earth rate has no level component',
    'The two positions of the first step at latitude 90. Psi_y acts on Z only through wN, which is zero here: it never moves Z, and no dwell helps. D_FY and D_IY, which show through wN as well, are lost with it. Drag the latitude away from 90: D_FY and D_IY return. The table says what differs from the first step.',
    { carry: 'platform', latitude_deg: 90, position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [180, 0, 0] }] }, 0, 0],
  ['Six positions show everything; only the D_I need a second derivative',
    'Six general attitudes: all fifteen unknowns are observable, psi with degree 0, nearly all drifts with degree 1. D_IX, D_IY and D_IZ have degree 2. Try other angles: where they are observable, their degree is never lower.',
    { carry: 'platform', position: SIX }],
  ['Why D_I is never below 2',
    'If all three D_I were equal to d, their drift would be d times g: about the vertical at every attitude. Drift about the vertical turns the azimuth, and only then, by the earth rate, the tilt: Z needs a second derivative. So D_IX + D_IY + D_IZ has degree 2 wherever it is observable (at the pole it is not), and each D_I holds a third of it; the differences have degree 1, as the rows at the end of the table say. Only a measured azimuth, which shows that turn at once, makes it less.',
    { carry: 'platform', combinations: ['D_IX + D_IY + D_IZ'], position: SIX }],
];
let tourStep = 0;

function drawTour() {
  const [title, text, scheme, selected = 0, against] = TOUR[tourStep];
  replace(copy(scheme), 'tour.toml');
  select(selected);
  show('scheme');
  compareWith(tourStep === 1 ? 0 : against);
  put($('tour-title'), title);
  put($('tour-text'), text);
  put($('tour-count'), `step ${tourStep + 1} of ${TOUR.length}`);
  $('tour-back').disabled = tourStep === 0;
  $('tour-next').disabled = tourStep === TOUR.length - 1;
}

/** Shows in the table the differences from another step; without a step, none. */
async function compareWith(step) {
  const mine = tourStep;
  verdicts.before = null;
  if (step === undefined) return;
  const request = { sources: [source(TOUR[step][2], 'tour.toml')], solutions: false, omitted: false };
  const found = await live.ask('verdicts', [request], { lane: 'tour' }).catch(() => null);
  if (!found?.answer || mine !== tourStep) return;
  verdicts.before = found;
  await answered;
  drawVerdicts();
}

function wireTour() {
  $('start-tour').addEventListener('click', () => { tourStep = 0; $('tour').hidden = false; drawTour(); $('tour-next').focus(); });
  $('tour-back').addEventListener('click', () => { tourStep--; drawTour(); });
  $('tour-next').addEventListener('click', () => { tourStep++; drawTour(); });
  $('tour-end').addEventListener('click', () => { $('tour').hidden = true; $('start-tour').focus(); });
}
