// Occluders between the lights and the lens: a matte or a depth plate, for all lights or for the chosen one.
import { button, choice, entry, group, h, slider, tick } from './ui.js';

export function holdoutGroup(app) {
  let whole = true;
  const light = () => (whole ? null : app.light);
  const here = (state) => (whole ? state.holdout : state.lights[app.light].holdout);
  const set = (values, held = '') => app.lively('set_holdout', { light: light(), values }, held);
  const name = h('span', { class: 'quietly' });
  const pickers = Object.fromEntries([['image', '.png,.exr,.jpg,.jpeg'], ['depth', '.exr']].map(([use, accept]) => {
    const picker = h('input', { type: 'file', accept, hidden: true, name: `holdout_${use}` });
    picker.addEventListener('change', async () => { if (picker.files[0]) await app.importFile(picker.files[0], use, light()); picker.value = ''; });
    return [use, picker];
  }));
  const none = button('None', () => app.command('set_holdout', { light: light(), values: null }).catch(() => {}), { id: 'holdout-none' });
  const files = h('div', { class: 'row', tip: 'A picture in the frame of the shot: a matte, where white lets light through, or an EXR depth plate, where nearer parts hide the light.' }, h('label', {}, 'Hidden by'),
    h('div', { class: 'fields' }, button('Matte…', () => pickers.image.click(), { id: 'holdout-image' }), button('Depth…', () => pickers.depth.click(), { id: 'holdout-depth' }), none, name, pickers.image, pickers.depth));
  const flip = tick({ label: 'White hides', name: 'holdout_invert', tip: 'For an alpha matte, which is white where it hides.', get: (s) => here(s)?.invert, set: (invert) => set({ invert }) });
  const unit = entry({ label: 'Depth unit', name: 'depth_unit', tip: 'Length of a depth of 1; 1000 for metres.', unit: 'mm', needed: 'needs a number', get: (s) => here(s)?.depth_unit_mm, set: (depth_unit_mm) => set({ depth_unit_mm }) });
  const over = slider({ label: 'Overscan', name: 'overscan', tip: 'Size of the picture relative to the frame, so that lights beside the frame can be hidden.', min: 1, max: 10, step: 0.01, curve: 2, get: (s) => here(s)?.overscan ?? 1, set: (overscan, held) => set({ overscan }, held) });
  const all = group('Occluders', [
    choice({ label: 'Of', name: 'holdout_of', tip: 'One picture for all lights, and an additional one for each light.', options: [['all', 'all lights'], ['one', 'the chosen light']], get: () => (whole ? 'all' : 'one'), set: (value) => { whole = value === 'all'; all.update(app.state); } }),
    { element: files, update: (s) => { const found = here(s); name.title = found?.image ?? found?.depth ?? ''; name.textContent = name.title.split(/[\\/]/).pop(); none.disabled = !found; } },
    flip, unit, over,
  ]);
  const { update } = all;
  all.update = (state) => {
    update(state);
    const found = here(state);
    flip.element.hidden = !found?.image;
    unit.element.hidden = !found?.depth;
    over.element.hidden = !found;
  };
  return all;
}
