// Iris, dirt and starburst.
import { drawMask } from './mask_sheet.js';
import { button, entry, group, h, number, row, slider, tick, toast } from './ui.js';

export function irisPanel(app) {
  const set = (values, held = '') => app.lively('set_iris', { values }, held);
  const dirt = (values, held = '') => app.lively('set_dirt', { values }, held);
  const star = (values, held = '') => app.lively('set_starburst', { values }, held);
  const mask = h('span', { class: 'quietly below' });
  const picker = h('input', { type: 'file', accept: '.png,.exr', hidden: true });
  picker.addEventListener('change', async () => { if (picker.files[0]) await app.importFile(picker.files[0], 'mask'); picker.value = ''; });
  const noMask = button('None', () => { const turned = app.state.iris.turned_before_mask; set({ mask: null, ...(turned === null ? {} : { rotation_deg: turned }) }); }, { id: 'mask-none' });
  const noDrawing = button('None', () => dirt({ image: null }));
  const dirty = h('span', { class: 'quietly below' });
  const dirtPicker = h('input', { type: 'file', accept: '.png,.exr', hidden: true, name: 'dirt_image' });
  dirtPicker.addEventListener('change', async () => { if (dirtPicker.files[0]) await app.importFile(dirtPicker.files[0], 'dirt'); dirtPicker.value = ''; });
  const sizes = [0, 1].map((k) => h('input', { class: 'number', type: 'text', style: 'width:58px', name: `dust_um_${k}`, 'aria-label': k ? 'Largest dust grain, micrometres' : 'Smallest dust grain, micrometres' }));
  for (const box of sizes) box.addEventListener('change', () => {
    if (number(box.value) !== null) { dirt({ dust_um: sizes.map((each) => number(each.value)) }); return; }
    const kept = app.state.dirt.dust_um[sizes.indexOf(box)];
    toast(`Dust: “${box.value}” is no number, so it stays ${kept}.`, 'error', 9000, 'dust_um');
    box.value = kept;
  });
  for (const box of sizes) box.addEventListener('keydown', (event) => { if (event.key === 'Enter') box.blur(); });
  const parts = [
    group('Blades', [
      slider({ label: 'Blades', tip: 'Ghosts become polygons and the starburst gets spikes: as many for an even number of blades, twice as many for an odd one. 0 is a round opening.', min: 0, max: 24, step: 1, digits: 0, name: 'blades', skip: (blades, by) => (blades === 1 || blades === 2 ? (by > 0 ? 3 : 0) : blades), get: (s) => s.iris.blades, set: (blades, held) => set({ blades }, held) }),
      slider({ label: 'Rotation', tip: 'Rotates the blades or the mask counter-clockwise; ghosts and spikes rotate with it, inverted ghosts upside down.', min: -180, max: 180, step: 1, digits: 0, unit: '°', name: 'rotation', get: (s) => s.iris.rotation_deg, set: (rotation_deg, held) => set({ rotation_deg }, held) }),
      slider({ label: 'Rounding', tip: 'Curvature of the blades: 0 is straight edges with sharp spikes, 1 a full circle without spikes.', min: 0, max: 1, step: 0.01, name: 'rounding', get: (s) => s.iris.rounding, set: (rounding, held) => set({ rounding }, held) }),
      slider({ label: 'Rough edges', tip: 'Deviation of the edges from their line: it frays the spikes of the starburst.', min: 0, max: 100, step: 1, digits: 0, curve: 2, unit: 'µm', get: (s) => s.iris.roughness_um, set: (roughness_um, held) => set({ roughness_um }, held) }),
      row('Mask', 'A grey picture instead of blades, where white lets light through: every ghost becomes an image of it.', [button('Draw…', () => drawMask((file) => app.importFile(file, 'mask'), app.state.iris), { id: 'mask-draw' }), button('Load…', () => picker.click(), { id: 'mask-load' }), noMask, mask, picker], (s) => { noMask.disabled = !s.iris.mask; mask.textContent = s.iris.mask ? `${s.iris.mask.split(/[\\/]/).pop()}, instead of blades${s.iris.rotation_deg ? `, rotated by ${Number(s.iris.rotation_deg.toFixed(1))}°` : ''}` : ''; }),
    ]),
    group('Dirt', [
      slider({ label: 'Dust', name: 'dust', tip: 'Opaque grains per mm² in the plane of the stop: each diffracts light into a wide, faint disc.', min: 0, max: 20, step: 0.05, curve: 2, get: (s) => s.dirt.dust_per_mm2, set: (dust_per_mm2, held) => dirt({ dust_per_mm2 }, held) }),
      slider({ label: 'Scratches', tip: 'Per cm²: each makes a thin streak perpendicular to its direction.', min: 0, max: 50, step: 0.1, curve: 2, digits: 1, get: (s) => s.dirt.scratches_per_cm2, set: (scratches_per_cm2, held) => dirt({ scratches_per_cm2 }, held) }),
      row('Dust from, to', 'Smallest and largest diameter of the grains: small ones spread light farther.', [sizes[0], sizes[1], h('span', { class: 'unit' }, 'µm')], (s) => sizes.forEach((box, k) => { if (document.activeElement !== box) box.value = s.dirt.dust_um[k]; })),
      entry({ label: 'Scratch width', tip: 'A thinner scratch makes a longer streak.', unit: 'µm', name: 'scratch_um', needed: 'needs a number', get: (s) => s.dirt.scratch_um, set: (scratch_um) => dirt({ scratch_um }) }),
      entry({ label: 'Scratch length', tip: 'Mean length; short scratches make wide streaks.', unit: 'mm', name: 'scratch_mm', needed: 'needs a number', get: (s) => s.dirt.scratch_mm, set: (scratch_mm) => dirt({ scratch_mm }) }),
      slider({ label: 'Fingerprint', tip: 'Fraction of the light that the ridges of one fingerprint absorb.', min: 0, max: 1, step: 0.01, get: (s) => s.dirt.fingerprint, set: (fingerprint, held) => dirt({ fingerprint }, held) }),
      slider({ label: 'Seed', tip: 'Another number gives another distribution of dirt.', min: 0, max: 100, step: 1, digits: 0, get: (s) => s.dirt.seed, set: (seed, held) => dirt({ seed }, held) }),
      row('Drawing', 'A grey picture of dirt over the opening, where white lets light through.', [button('Load…', () => dirtPicker.click(), { id: 'dirt-load' }), noDrawing, dirty, dirtPicker], (s) => { noDrawing.disabled = !s.dirt.image; dirty.textContent = s.dirt.image ? s.dirt.image.split(/[\\/]/).pop() : ''; }),
      tick({ label: 'Also in ghosts', tip: 'Dirt at the stop also casts shadows inside the ghosts, as each ghost is an image of the stop.', get: (s) => s.dirt.in_ghosts, set: (in_ghosts) => dirt({ in_ghosts }) }),
    ]),
    group('Starburst', [
      slider({ label: 'Size', tip: 'Factor on the size of the pattern; 1 is physical: f-number and wavelength determine the size.', min: 0.1, max: 20, step: 0.05, curve: 3, get: (s) => s.starburst.size, set: (size, held) => star({ size }, held) }),
      slider({ label: 'Intensity', tip: 'Factor on its light; 1 is physical.', min: 0, max: 20, step: 0.05, curve: 3, get: (s) => s.starburst.intensity, set: (intensity, held) => star({ intensity }, held) }),
      tick({ label: 'Cat’s eye', tip: 'Clips the opening by the rims at the light’s angle, so the pattern becomes asymmetric towards the border.', get: (s) => s.starburst.cats_eye, set: (cats_eye) => star({ cats_eye }) }),
    ]),
  ];
  return {
    element: h('div', {}, ...parts.map((part) => part.element)),
    update(state) { parts.forEach((part) => part.update(state)); },
  };
}
