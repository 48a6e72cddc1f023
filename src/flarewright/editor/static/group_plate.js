// The plate under the flare, and the lights that are found in it.
import { complain, get, latest, sentence } from './api.js';
import { button, entry, group, h, slider, tick } from './ui.js';

const SUFFIXES = '.exr,.tif,.tiff,.png,.jpg,.jpeg,.webp';

export function plateGroup(app) {
  const found = { key: '', size: null, lights: [], words: '' };
  // outlines of what a search would find; the handles of found lights replace them
  let outlines = true;
  let shown = false;
  app.plateLights = () => (shown && outlines && found.size && app.state.plate?.image === found.image ? found : null);
  // the gain changes no outline
  const keyOf = (s) => JSON.stringify([s.plate.image, s.plate.layer, s.plate.transfer, { ...s.plate.search, gain: 1 }]);
  const look = latest(async () => {
    const { plate } = app.state;
    if (!plate || !shown || !outlines || app.state.finding.running || app.state.lens.measured) return;
    const key = keyOf(app.state);
    if (key === found.key) return;
    Object.assign(found, { size: null, lights: [], words: '' }, await get('api/plate/lights'), { key, image: plate.image });
    tell(app.state);
    app.view.redraw();
    // the settings may have changed meanwhile
    if (app.state.plate && keyOf(app.state) !== key) look();
  });
  const name = h('span', { class: 'quietly' });
  const picker = h('input', { type: 'file', accept: SUFFIXES, hidden: true, name: 'plate' });
  picker.addEventListener('change', async () => { if (picker.files[0]) await app.importFile(picker.files[0]); picker.value = ''; });
  const lit = (s) => Boolean(s.plate?.lit);
  // exposure since a lit plate was removed, and the one that undo brings back with it
  let left = null;
  function brought(s) {
    if (!left || !lit(s)) return;
    const { held, before } = left;
    left = null;
    if (s.view.exposure_stops === held) app.setView({ exposure_stops: before });
  }
  async function remove() {
    const { view } = app.state;
    const wasLit = lit(app.state);
    await app.command('remove_plate', {}).catch(() => {});
    // the flare stays as bright as it was over the plate
    if (!wasLit || app.state.plate) return;
    left = { held: view.plate_stops, before: view.exposure_stops };
    app.setView({ exposure_stops: left.held });
  }
  const none = button('None', remove, { id: 'plate-none', tip: 'Remove the plate.' });
  const files = h('div', { class: 'row', tip: 'A photograph, or a frame of a film, under the flare: EXR, TIFF, PNG, JPEG. It can also be dropped on the page, or opened by its path. A render draws the flare alone.' }, h('label', {}, 'Picture'),
    h('div', { class: 'fields' }, button('Choose…', () => picker.click(), { id: 'plate-choose' }), none, name, picker));
  const search = (values, held = '') => { outlines = true; return app.lively('set_plate', { values: { search: values } }, held); };
  const at = (s) => s.plate?.search ?? {};
  const exposure = slider({ label: 'Its brightness', tip: 'Exposure of the plate, in stops. When its lights are found, the exposure above the picture serves both.', min: -8, max: 8, step: 0.1, digits: 1, unit: 'stops', name: 'plate_stops', get: (s) => s.view.plate_stops, set: (plate_stops) => app.setView({ plate_stops }) });
  const visible = tick({ label: 'Show it', name: 'plate_shown', tip: 'Without it, the flare alone is shown on black.', get: (s) => s.view.plate_shown, set: (plate_shown) => app.setView({ plate_shown }) });
  const threshold = slider({ label: 'Threshold', name: 'plate_threshold', tip: 'Pixels this many stops above the mean of the plate are lights; on a display picture at most near its white.', min: -2, max: 12, step: 0.1, digits: 1, unit: 'stops', get: (s) => at(s).stops, set: (stops, held) => search({ stops, threshold: null }, held) });
  // works at once, for found lights too
  const gain = slider({ label: 'Brighter by', name: 'plate_gain', tip: 'A plate clips its lamps at white, so they are brighter than it shows: by how much, in stops. It changes all found lights at once.', min: 0, max: 20, step: 0.1, digits: 1, unit: 'stops', get: (s) => Math.log2(at(s).gain ?? 1), set: (stops, held) => app.lively('set_plate', { values: { search: { gain: 2 ** stops } } }, held) });
  const outline = tick({ label: 'Outlines', name: 'plate_outlines', tip: 'Outlines what a search would find.', get: () => outlines, set: (on) => { outlines = on; look(); tell(app.state); app.view.redraw(); } });
  const number = (label, field, tip, more = {}) => entry({ label, tip, name: `plate_${field}`, get: (s) => at(s)[field], set: (value) => search({ [field]: value }), ...more });
  const more = [
    number('Threshold value', 'threshold', 'The threshold as a value of the plate (luminance), instead of stops.', { placeholder: 'from the stops' }),
    number('Smallest', 'least_px', 'Areas of fewer pixels are left out: 2 leaves out single pixels, which are often defects.', { unit: 'px', digits: 0, needed: 'needs a number of pixels' }),
    number('Most lights', 'most_lights', 'The brightest stay; the others are joined to a few, which have ghosts alone. Time grows with their number.', { digits: 0, needed: 'needs a number' }),
    number('Points below', 'point_px', 'Narrower lights are points; wider ones are discs and rectangles, which blur their ghosts and cost time.', { unit: 'px', placeholder: 'half a percent of the width' }),
    number('White stands for', 'highlights', 'Plate value that the clipped white of a display picture stands for, such as 50; dark values stay.', { placeholder: '1' }),
    number('White paper', 'white', 'Plate value of white paper in the sun, for a lamp of known brightness.', { placeholder: 'not known' }),
    entry({ label: 'Lamp', tip: 'Brightness of the clipped lights: sun, headlight@METRES or lamp:LUMEN@METRES, such as lamp:800@3. Needs White paper.', name: 'plate_source', words: true, placeholder: 'as bright as the plate shows', get: (s) => at(s).source, set: (source) => search({ source: source || null }) }),
  ];
  const further = h('details', {}, h('summary', {}, 'More'), ...more.map((one) => one.element));
  const find = button('Find lights', async () => { if (await app.ask('api/plate/find')) { outlines = false; app.view.redraw(); } }, { id: 'find-lights', kind: 'main', tip: 'Makes the bright areas of the plate the lights of the project, as one step of the history: their flare has the unit of the plate, and sits in it. Found lights can be moved, changed and removed.' });
  const cancel = button('Cancel', async () => { outlines = true; try { app.take(await app.postNow('api/plate/stop')); } catch (error) { complain(error); } }, { id: 'find-cancel' });
  const bar = h('i');
  const meter = h('span', { class: 'bar' }, bar);
  const words = h('p', { class: 'quietly', id: 'plate-words' });
  const buttons = h('div', { class: 'buttons' }, find, cancel, meter);
  function tell(s) {
    const run = s.finding;
    find.hidden = run.running;
    cancel.hidden = meter.hidden = !run.running;
    bar.style.width = `${100 * run.part}%`;
    if (run.running) words.textContent = `${run.words.charAt(0).toUpperCase()}${run.words.slice(1)}…`;
    else if (outlines && s.plate && found.key === keyOf(s)) words.textContent = `${found.lights.length ? `${found.lights.length} light${found.lights.length > 1 ? 's' : ''} outlined${s.plate.lit ? ', those of the next search' : ''}. ` : ''}${found.words ? sentence(found.words) : ''}`;
    else words.textContent = s.plate?.lit ? 'The lights are those of the plate; the flare has its unit. Another f-number or lens keeps them in place.' : '';
  }
  const all = group('Plate', [{ element: files, update: (s) => { name.textContent = s.plate ? s.plate.image.split(/[\\/]/).pop() : 'drop a photograph here'; name.title = s.plate?.image ?? ''; none.disabled = !s.plate; } }, visible, exposure, threshold, gain, outline, { element: further, update: (s) => more.forEach((one) => one.update(s)) }, buttons, words]);
  const { update } = all;
  return Object.assign(all, {
    update(s) {
      update(s);
      const hidden = !s.plate || Boolean(s.lens.measured);
      for (const part of [threshold.element, gain.element, outline.element, further, buttons, words]) part.hidden = hidden;
      visible.element.hidden = !s.plate;
      exposure.element.hidden = !s.plate || lit(s);
      tell(s);
      look();
      brought(s);
    },
    // Whether the panel is open: outlines are shown with it.
    open(on) { shown = on; if (on && app.state) look(); app.view.redraw(); },
  });
}
