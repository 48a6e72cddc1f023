// Lights, camera, view.
import { holdoutGroup } from './group_holdout.js';
import { pathGroup } from './group_path.js';
import { ofLens } from './of_lens.js';
import { button, choice, entry, group, h, refill, slider, tick } from './ui.js';

const SPECTRA = [['d65', 'Daylight D65'], ['equal-energy', 'Equal energy'], ['black-body:3200', 'Tungsten 3200 K'], ['black-body:5600', 'Black body 5600 K'], ['black-body:2000', 'Candle 2000 K'], ['lines:589.0,589.6', 'Sodium lamp'], ['rgb:1,0.25,0.1', 'Red light'], ['rgb:0.15,0.4,1', 'Blue light']];
const SENSORS = [['', '36 mm wide'], ['36x24', 'Full frame 36 × 24'], ['24.89x18.66', 'Super 35 4-perf'], ['23.6x15.7', 'APS-C'], ['17.3x13', 'Four Thirds'], ['54.12x25.58', 'Large format 65'], ['43.8x32.9', 'Medium 44 × 33']];
const SIZES = [['1280x720', '1280 × 720'], ['1920x1080', '1920 × 1080'], ['2048x1080', '2K DCI'], ['3840x2160', '3840 × 2160'], ['4096x2160', '4K DCI'], ['1500x1000', '3:2 1500 × 1000'], ['1440x1080', '4:3 1440 × 1080'], ['1080x1080', 'Square'], ['2048x858', '2.39:1']];

// The largest part of a sensor with the picture's aspect ratio, so that pixels are square.
const cropped = ([width, height], [across, down]) => (width * down > height * across ? [height * across / down, height] : [width, width * down / across]);
const pair = (text) => text.split('x').map(Number);
function sensorOf({ sensor_mm: own, size_px: size }) {
  if (!own) return '';
  const known = SENSORS.find(([key]) => key && cropped(pair(key), size).every((mm, axis) => Math.abs(mm - own[axis]) < 0.006));
  return known ? known[0] : own.join(' × ');
}
const fitted = (key, size) => cropped(pair(key), size).map((mm) => Number(mm.toFixed(3)));

export function lightPanel(app) {
  const one = (state) => state.lights[app.light];
  const set = (values, held = '') => app.lively('set_light', { light: app.light, values }, held);
  const across = entry({ label: 'Right', tip: 'Field angle: the direct image lies focal length × tan(angle) to the right of the middle.', unit: '°', name: 'light_x', digits: 3, needed: 'needs an angle', get: (s) => one(s).field_deg[0], set: (x) => app.command('move_light', { light: app.light, x, y: one(app.state).field_deg[1] }).catch(() => {}) });
  const up = entry({ label: 'Up', tip: 'Field angle upwards. A light outside the frame has no direct image, but its ghosts may reach the frame.', unit: '°', name: 'light_y', digits: 3, needed: 'needs an angle', get: (s) => one(s).field_deg[1], set: (y) => app.command('move_light', { light: app.light, x: one(app.state).field_deg[0], y }).catch(() => {}) });
  const choose = h('div', { class: 'buttons' });
  const lights = group('Lights', [
    choose, across, up,
    slider({ label: 'Intensity', tip: 'Irradiance of the light on a plane facing it; all its ghosts scale with it.', min: 0, max: 10, step: 0.01, curve: 2, name: 'intensity', get: (s) => one(s).intensity, set: (intensity, held) => set({ intensity }, held) }),
    choice({ label: 'Spectrum', tip: 'Spectrum of the light: coatings reflect each wavelength differently, so the spectrum colours the ghosts.', name: 'spectrum', options: SPECTRA, get: (s) => one(s).spectrum, set: (spectrum) => set({ spectrum }) }),
    ofLens(slider({ label: 'Disc', tip: 'Angular diameter of the light: 0 is a point, 0.53° the sun. A wide light blurs every ghost.', min: 0, max: 10, step: 0.01, curve: 2, unit: '°', get: (s) => one(s).diameter_deg, set: (diameter_deg, held) => set({ diameter_deg }, held) })),
    ofLens(entry({ label: 'Distance', tip: 'Distance from the first vertex; empty: infinitely far, with parallel rays.', unit: 'mm', placeholder: 'far', name: 'distance', get: (s) => one(s).distance, set: (distance) => set({ distance }) })),
  ]);
  const path = pathGroup(app);
  const hiding = holdoutGroup(app);
  const view = (values) => app.setView(values);
  const plate = h('span', { class: 'quietly' });
  const picker = h('input', { type: 'file', accept: '.exr,.png,.jpg,.jpeg', hidden: true });
  picker.addEventListener('change', async () => { if (picker.files[0]) await app.importFile(picker.files[0]); picker.value = ''; });
  const seeing = group('View', [
    ofLens(tick({ label: 'Grey', name: 'grey', tip: 'All surfaces reflect alike, regardless of coatings, so that ghosts hidden by coatings can be seen and dragged (G).', get: (s) => s.view.grey, set: (grey) => view({ grey }) })),
    ofLens(tick({ label: 'No entrance clip', name: 'unclipped', tip: 'The first surface has no rim: shows ghosts that the entrance hides at this angle (E).', get: (s) => s.view.unclipped, set: (unclipped) => view({ unclipped }) })),
    tick({ label: 'Safe frame', name: 'safe', tip: 'Lines at 90 % and 80 % of the frame (H).', get: (s) => s.view.safe_frame, set: (safe_frame) => view({ safe_frame }) }),
    { element: h('div', { class: 'row', tip: 'A picture under the flare, to judge it in its scene; it is added as linear light before the view. No file contains it.' }, h('label', {}, 'Background'), h('div', { class: 'fields' }, button('Choose…', () => picker.click()), button('None', () => view({ plate: null })), plate, picker)), update: (s) => { plate.textContent = s.view.plate ? s.view.plate.split(/[\\/]/).pop() : ''; } },
    slider({ label: 'Its brightness', tip: 'Brightness of the background, in stops.', min: -8, max: 8, step: 0.1, digits: 1, unit: 'stops', get: (s) => s.view.plate_stops, set: (plate_stops) => view({ plate_stops }) }),
  ]);
  const camera = (values, held = '') => app.lively('set_camera', { values }, held);
  const shot = group('Camera', [
    ofLens(slider({ label: 'f-number', tip: 'Closing the iris shrinks the ghosts that it bounds, at equal brightness; the starburst grows.', min: 0.7, max: 32, step: 0.1, digits: 1, curve: 2, name: 'f_number', get: (s) => s.lens.f_number ?? s.lens.open, set: (value, held) => app.lively('set_fields', { values: { f_number: value } }, held) }), (s) => Boolean(s.lens.open)),
    ofLens(choice({ label: 'Zoom position', tip: 'Zoom positions of the lens file: they change the gaps between groups.', options: (s) => [['', 'as in the table'], ...(s.lens.positions ?? []).map((name) => [name, name])], get: (s) => s.lens.zoom ?? '', set: (zoom) => app.command('set_fields', { values: { zoom: zoom || null } }).catch(() => {}) })),
    choice({ label: 'Picture', tip: 'Pixels of the rendered file; the viewport has the same aspect ratio.', name: 'size', options: SIZES, get: (s) => s.camera.size_px.join('x'), set: (text) => { const size = pair(text).map(Math.round); const key = sensorOf(app.state.camera); camera({ size_px: size, ...(SENSORS.some(([known]) => known && known === key) ? { sensor_mm: fitted(key, size) } : {}) }); } }),
    ofLens(choice({ label: 'Sensor', tip: 'A smaller sensor records a smaller part of the same flare. The largest part with the picture’s aspect ratio is used.', name: 'sensor', options: SENSORS, get: (s) => sensorOf(s.camera), set: (key) => camera({ sensor_mm: key ? fitted(key, app.state.camera.size_px) : null }) })),
    ofLens(entry({ label: 'Focus distance', tip: 'Distance of the plane in focus in front of the lens; focusing moves the sensor, and the ghosts with it.', unit: 'mm', placeholder: 'infinity', get: (s) => s.camera.focus_distance, set: (focus_distance) => camera({ focus_distance }) })),
    ofLens(slider({ label: 'Sensor reflects', tip: 'Reflectance of the sensor: light that it reflects into the lens makes additional ghosts.', min: 0, max: 0.3, step: 0.005, digits: 3, get: (s) => s.camera.sensor_reflectance, set: (sensor_reflectance, held) => camera({ sensor_reflectance }, held) })),
  ]);
  const work = group('Final picture', [
    ofLens(slider({ label: 'Wavelengths', tip: 'Number of traced wavelengths: with few of them, dispersion shows as steps of colour.', min: 3, max: 31, step: 1, digits: 0, get: (s) => s.quality.wavelengths, set: (wavelengths, held) => app.lively('set_quality', { values: { wavelengths } }, held) })),
    ofLens(choice({ label: 'Rings in ghosts', tip: 'Diffraction at the iris makes rings in the ghosts; Collins’ integral computes them for each ghost from its matrix.', options: [['off', 'off'], ['collins', 'exact (Collins)'], ['frft', 'Hullin’s estimate']], get: (s) => s.quality.ringing, set: (ringing) => app.command('set_quality', { values: { ringing } }).catch(() => {}) })),
    ofLens(choice({ label: 'Reflections', tip: 'Ghosts of four reflections are fainter; they are found by random sampling and drawn by rays.', options: [['2', 'two'], ['4', 'two and four']], get: (s) => String(s.quality.orders), set: (orders) => app.command('set_quality', { values: { orders: Number(orders) } }).catch(() => {}) })),
    slider({ label: 'Ghosts ×', tip: 'Factor on the light of all ghosts; 1 is physical.', min: 0, max: 10, step: 0.01, curve: 2, get: (s) => s.pass_gain.ghosts ?? 1, set: (gain, held) => app.lively('set_pass_gain', { name: 'ghosts', gain }, held) }),
    slider({ label: 'Starburst ×', tip: 'Factor on the direct image and its diffraction; 1 is physical.', min: 0, max: 10, step: 0.01, curve: 2, get: (s) => s.pass_gain.starburst ?? 1, set: (gain, held) => app.lively('set_pass_gain', { name: 'starburst', gain }, held) }),
  ]);
  return {
    element: h('div', {}, lights.element, path.element, shot.element, seeing.element, hiding.element, work.element),
    update(state) {
      refill(choose, [...state.lights.map((light, k) => button(light.name === 'light' ? `Light ${k + 1}` : light.name.charAt(0).toUpperCase() + light.name.slice(1), () => { app.chooseLight(k); app.panels.light.update(app.state); app.view.redraw(); }, { kind: k === app.light ? 'on' : '', tip: 'Choose the light for the controls below, the arrow keys and drags in the picture.' })),
        button('+', () => app.command('add_light', {}).then(() => { app.chooseLight(app.state.lights.length - 1); app.view.redraw(); }).catch(() => {}), { id: 'light-add', kind: 'quiet', tip: 'Add a light.' }),
        button('Remove', () => app.command('remove_light', { light: app.light }).catch(() => {}), { kind: 'quiet', disabled: state.lights.length < 2, tip: 'Remove the chosen light; the last one cannot be removed.' })]);
      for (const part of [lights, path, shot, seeing, hiding, work]) part.update(state);
    },
    moved(angles) {
      across.element.querySelector('input').value = angles[0].toFixed(2);
      up.element.querySelector('input').value = angles[1].toFixed(2);
    },
  };
}
