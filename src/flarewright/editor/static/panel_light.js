// Lights, camera, view.
import { holdoutGroup } from './group_holdout.js';
import { pathGroup } from './group_path.js';
import { plateGroup } from './group_plate.js';
import { ofLens } from './of_lens.js';
import { button, choice, entry, group, h, press, refill, row, slider, tick } from './ui.js';

const SPECTRA = [['d65', 'Daylight D65'], ['equal-energy', 'Equal energy'], ['black-body:3200', 'Tungsten 3200 K'], ['black-body:5600', 'Black body 5600 K'], ['black-body:2000', 'Candle 2000 K'], ['lines:589*1,589.6*1', 'Sodium lamp'], ['rgb:1,0.25,0.1', 'Red light'], ['rgb:0.15,0.4,1', 'Blue light']];
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
  // changes of one of several numbers that a command takes together
  const move = (axis, angle) => { const { light } = app; app.command('move_light', () => { const angles = app.state.lights[light]?.field_deg.with(axis, angle); return angles ? { light, x: angles[0], y: angles[1] } : null; }).catch(() => {}); };
  const reshape = (change) => { const { light } = app; app.lively('set_light', () => { const shape = structuredClone(app.state.lights[light]?.shape); if (!shape) return null; change(shape); return { light, values: { shape } }; }, ''); };
  const across = entry({ label: 'Right', tip: 'Field angle: the direct image lies focal length × tan(angle) to the right of the middle.', unit: '°', name: 'light_x', digits: 3, needed: 'needs an angle', get: (s) => one(s).field_deg[0], set: (x) => move(0, x) });
  const up = entry({ label: 'Up', tip: 'Field angle upwards. A light outside the frame has no direct image, but its ghosts may reach the frame.', unit: '°', name: 'light_y', digits: 3, needed: 'needs an angle', get: (s) => one(s).field_deg[1], set: (y) => move(1, y) });
  const choose = h('div', { class: 'buttons lamps' });
  const plainIntensity = slider({ label: 'Intensity', tip: 'Irradiance of the light on a plane facing it; all its ghosts scale with it.', min: 0, max: 10, step: 0.01, curve: 2, name: 'intensity', get: (s) => one(s).intensity, set: (intensity, held) => set({ intensity }, held) });
  // lights of a plate have its unit, in which a lamp may be a million times fainter than the sun
  const litIntensity = slider({ label: 'Intensity', tip: 'Irradiance of the light in the unit of the plate; a key of the slider changes it by a tenth of a stop.', min: 1e-8, max: 1e6, log: true, name: 'lit_intensity', get: (s) => one(s).intensity, set: (intensity, held) => set({ intensity }, held) });
  const colour = h('input', { type: 'color', name: 'light_colour' });
  colour.addEventListener('change', () => set({ spectrum: `rgb:${[1, 3, 5].map((k) => Number(((parseInt(colour.value.slice(k, k + 2), 16) / 255) ** 2.2).toFixed(4))).join(',')}` }));
  const rgbOf = (s) => (one(s).spectrum.startsWith('rgb:') ? one(s).spectrum.slice(4).split(',').map(Number) : null);
  const tint = row('Colour', 'Colour of its light.', [colour], (s) => {
    const rgb = rgbOf(s);
    tint.element.hidden = !rgb;
    if (rgb) colour.value = `#${rgb.map((part) => Math.round(255 * (part / Math.max(...rgb)) ** (1 / 2.2)).toString(16).padStart(2, '0')).join('')}`;
  });
  const spectra = (s) => (rgbOf(s) && !SPECTRA.some(([key]) => key === one(s).spectrum) ? [...SPECTRA, [one(s).spectrum, 'Colour below']] : SPECTRA);
  const sides = (s) => (one(s).shape?.kind === 'rectangle' ? one(s).shape : null);
  const side = (label, k, tip) => ofLens(entry({ label, tip, unit: '°', name: `light_${label.toLowerCase()}`, needed: 'needs an angle', get: (s) => (k < 2 ? sides(s)?.size_deg[k] : sides(s)?.rotation_deg), set: (value) => reshape((shape) => { if (k < 2) shape.size_deg[k] = value; else shape.rotation_deg = value; }) }));
  const rectangle = [side('Width', 0, 'Angular width of the rectangle.'), side('Height', 1, 'Angular height of the rectangle.'), side('Turned', 2, 'Rotation of the rectangle, counter-clockwise.')];
  const disc = ofLens(slider({ label: 'Disc', tip: 'Angular diameter of the light: 0 is a point, 0.53° the sun. A wide light blurs every ghost.', min: 0, max: 10, step: 0.01, curve: 2, unit: '°', get: (s) => one(s).diameter_deg, set: (diameter_deg, held) => set({ diameter_deg }, held) }));
  const formed = ofLens(choice({ label: 'Shape', name: 'light_shape', tip: 'A rectangle serves for windows, signs and tubes.', options: (s) => [['disc', 'point or disc'], ['rectangle', 'rectangle'], ...(one(s).shape?.kind === 'polygon' ? [['polygon', 'polygon']] : [])], get: (s) => one(s).shape?.kind ?? 'disc', set: (kind) => { const wide = one(app.state).diameter_deg || 1; if (kind === 'rectangle') set({ shape: { kind, size_deg: [wide, wide] }, diameter_deg: 0 }); else if (kind === 'disc') set({ shape: null, diameter_deg: sides(app.state)?.size_deg[1] ?? 0 }); } }));
  const lights = group('Lights', [
    choose, across, up,
    plainIntensity,
    litIntensity,
    choice({ label: 'Spectrum', tip: 'Spectrum of the light: coatings reflect each wavelength differently, so the spectrum colours the ghosts.', name: 'spectrum', options: spectra, get: (s) => one(s).spectrum, set: (spectrum) => set({ spectrum }) }),
    tint, formed, disc, ...rectangle,
    ofLens(entry({ label: 'Distance', tip: 'Distance from the first vertex; empty: infinitely far, with parallel rays.', unit: 'mm', placeholder: 'far', name: 'distance', get: (s) => one(s).distance, set: (distance) => set({ distance }) })),
  ]);
  const path = pathGroup(app);
  const hiding = holdoutGroup(app);
  const view = (values) => app.setView(values);
  const plate = plateGroup(app);
  const seeing = group('View', [
    ofLens(tick({ label: 'Grey', name: 'grey', tip: 'All surfaces reflect alike, regardless of coatings, so that ghosts hidden by coatings can be seen and dragged (G).', get: (s) => s.view.grey, set: (grey) => view({ grey }) })),
    ofLens(tick({ label: 'No entrance clip', name: 'unclipped', tip: 'The first surface has no rim: shows ghosts that the entrance hides at this angle (E).', get: (s) => s.view.unclipped, set: (unclipped) => view({ unclipped }) })),
    tick({ label: 'Safe frame', name: 'safe', tip: 'Lines at 90 % and 80 % of the frame (H).', get: (s) => s.view.safe_frame, set: (safe_frame) => view({ safe_frame }) }),
  ]);
  const camera = (values, held = '') => app.lively('set_camera', { values }, held);
  const shot = group('Camera', [
    ofLens(slider({ label: 'f-number', tip: 'Closing the iris shrinks the ghosts that it bounds, at equal brightness; the starburst grows.', min: 0.7, max: 32, step: 0.1, digits: 1, curve: 2, name: 'f_number', get: (s) => s.lens.f_number ?? s.lens.open, set: (value, held) => app.lively('set_fields', { values: { f_number: value } }, held) }), (s) => Boolean(s.lens.open)),
    ofLens(choice({ label: 'Zoom position', tip: 'Zoom positions of the lens file: they change the gaps between groups; the table of the panel Lens shows those of the chosen one.', options: (s) => [['', 'none: the gaps of the rows'], ...(s.lens.positions ?? []).map((name) => [name, name])], get: (s) => s.lens.zoom ?? '', set: (zoom) => app.command('set_fields', { values: { zoom: zoom || null } }).catch(() => {}) })),
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
    element: h('div', {}, lights.element, plate.element, path.element, shot.element, seeing.element, hiding.element, work.element),
    update(state) {
      refill(choose, [...state.lights.map((light, k) => press(button(light.label, () => { app.chooseLight(k); app.panels.light.update(app.state); app.view.redraw(); }, { tip: 'Choose the light for the controls below, the arrow keys and drags in the picture.' }), k === app.light)),
        button('+', () => app.command('add_light', {}).then(() => { app.chooseLight(app.state.lights.length - 1); app.view.redraw(); }).catch(() => {}), { id: 'light-add', kind: 'quiet', 'aria-label': 'Add a light', tip: 'Add a light.' }),
        button('Remove', () => app.command('remove_light', { light: app.light }).catch(() => {}), { kind: 'quiet', disabled: state.lights.length < 2, tip: 'Remove the chosen light; the last one cannot be removed.' })]);
      plainIntensity.element.hidden = Boolean(state.plate?.lit);
      litIntensity.element.hidden = !plainIntensity.element.hidden;
      for (const part of [lights, plate, path, shot, seeing, hiding, work]) part.update(state);
      disc.element.hidden ||= Boolean(one(state).shape);
      for (const part of rectangle) part.element.hidden ||= !sides(state);
    },
    open: (on) => plate.open(on),
    moved(angles) {
      across.element.querySelector('input').value = angles[0].toFixed(2);
      up.element.querySelector('input').value = angles[1].toFixed(2);
    },
  };
}
