// Five steps that show the use of the page; each sets its scheme.
import { $, put } from './dom.js';
import { live } from './engine.js';
import { say } from './notice.js';
import { copy, replace, select, source, state } from './scheme.js';
import { drawVerdicts } from './table.js';
import { show } from './tabs.js';
import { writing } from './text.js';
import { verdicts } from './verdicts.js';

const SIX = [[10, 25, 40], [130, -50, 70], [-95, 33, -160], [60, 80, 15], [-20, -70, 110], [170, 15, -75]].map((angles_deg) => ({ angles_deg }));
// the control of a step is framed; `against` is the step whose verdicts the table compares with
const TOUR = [
  {
    title: 'Two positions do not show the azimuth',
    text: 'p1 and p2 are upside down of each other. Z sees the tilts psi_x and psi_z at once (degree 0). The azimuth psi_y is linked with D_FZ: it shows only by the earth rate that it leads into the level axis, and a drift of that axis looks the same at both positions.',
    scheme: { carry: 'platform', position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [180, 0, 0] }] },
    control: 'positions', named: 'the positions',
  },
  {
    title: 'A position whose vertical axis is another makes psi_y observable',
    text: 'Now p2 has another axis of the platform along the vertical (alpha 90 instead of 180). Carried with the platform, what was azimuth at p1 is partly tilt at p2, and tilt is seen at once: psi_y has degree 0. Drag alpha of p2: every angle does it but 0 and \u00b1180 degrees, the marks under the slider. A turn about the vertical alone (alpha 0, beta 90) brings psi_y only through the earth rate, with degree 1.',
    scheme: { carry: 'platform', position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [90, 0, 0] }] },
    selected: 1, against: 0, control: 'alpha', named: 'the slider of alpha',
  },
  {
    title: 'At the pole the earth rate has no level component',
    text: 'The two positions of the first step at latitude 90. Psi_y acts on Z only through wN, which is zero here: it never moves Z, and no dwell helps. D_FY and D_IY, which show through wN as well, are lost with it. Drag the latitude away from 90: D_FY and D_IY return. The table says what differs from the first step.',
    scheme: { carry: 'platform', latitude_deg: 90, position: [{ angles_deg: [0, 0, 0] }, { angles_deg: [180, 0, 0] }] },
    against: 0, control: 'latitude', named: 'the latitude',
  },
  {
    title: 'Six positions show everything; only the D_I need a second derivative',
    text: 'Six general attitudes: all fifteen unknowns are observable, psi with degree 0, nearly all drifts with degree 1. D_IX, D_IY and D_IZ have degree 2. Try other angles: where they are observable, their degree is never lower.',
    scheme: { carry: 'platform', position: SIX },
    control: 'sliders', named: 'the angles',
  },
  {
    title: 'Why D_I is never below 2',
    text: 'If all three D_I were equal to d, their drift would be d times g: about the vertical at every attitude. Drift about the vertical turns the azimuth, and only then, by the earth rate, the tilt: Z needs a second derivative. So D_IX + D_IY + D_IZ has degree 2 wherever it is observable (at the pole it is not), and each D_I holds a third of it; the differences have degree 1, as the rows at the end of the table say. Only a measured azimuth, which shows that turn at once, makes it less.',
    scheme: { carry: 'platform', combinations: ['D_IX + D_IY + D_IZ'], position: SIX },
    control: 'verdicts', named: 'the table',
  },
];
const TOUR_FILE = 'tour.toml';
let tourStep = 0;
// the scheme before the tour, its name and selected position
let beforeTour = null;

function drawTour() {
  const { title, text, scheme, selected = 0, against, control, named } = TOUR[tourStep];
  replace(copy(scheme), TOUR_FILE);
  select(selected);
  show('scheme');
  compareWith(against);
  light(control);
  put($('tour-show'), `Go to ${named}`);
  put($('tour-title'), title);
  put($('tour-text'), text);
  put($('tour-count'), `step ${tourStep + 1} of ${TOUR.length}`);
  $('tour-back').disabled = tourStep === 0;
  const last = tourStep === TOUR.length - 1;
  if (last && document.activeElement === $('tour-next')) $('tour-show').focus();
  $('tour-next').disabled = last;
}

/** Frames a control; without one, none. */
function light(id) {
  document.querySelectorAll('.lit').forEach((e) => e.classList.remove('lit'));
  if (id) $(id).classList.add('lit');
}

/** Brings the framed control into view, with the focus if it takes it. */
function goToControl() {
  const control = $(TOUR[tourStep].control);
  control.scrollIntoView({ block: 'center' });
  (control.matches('input, [tabindex]') ? control : control.querySelector('button, input'))?.focus({ preventScroll: true });
}

/** Closes the tour: the scheme stays as it is now. */
function quitTour() {
  if ($('tour').hidden) return;
  $('tour').hidden = true;
  light(null);
  if (writing.name === TOUR_FILE) writing.name = beforeTour.name;
  beforeTour = null;
}

/** Closes the tour if the scheme was opened, or replaced by one that is not of the tour. */
export function leaveTour(opened) {
  if (opened || state.name !== TOUR_FILE) quitTour();
}

/** Ends the tour: the scheme from before it is back. */
function endTour() {
  const { scheme, name, selected } = beforeTour;
  quitTour();
  replace(scheme, name);
  select(selected);
  verdicts.before = null;
  say('Your scheme is back as it was before the tour; Undo returns to the scheme of the tour.', 'fine');
  $('start-tour').focus();
}

/** Shows in the table the differences from another step; without a step, none. */
async function compareWith(step) {
  const mine = tourStep;
  verdicts.before = null;
  if (step === undefined) return;
  const request = { sources: [source(TOUR[step].scheme, TOUR_FILE)], solutions: false, omitted: false };
  const found = await live.ask('verdicts', [request], { topic: 'tour' }).catch(() => null);
  if (!found?.answer || mine !== tourStep) return;
  verdicts.before = found;
  await verdicts.answered;
  drawVerdicts();
}

export function wireTour() {
  $('start-tour').addEventListener('click', () => {
    beforeTour ??= copy({ scheme: state.scheme, name: state.name, selected: state.selected });
    tourStep = 0;
    $('tour').hidden = false;
    drawTour();
    $('tour-next').focus();
  });
  $('tour-show').addEventListener('click', goToControl);
  $('tour-back').addEventListener('click', () => { tourStep--; drawTour(); });
  $('tour-next').addEventListener('click', () => { tourStep++; drawTour(); });
  $('tour-end').addEventListener('click', endTour);
}
