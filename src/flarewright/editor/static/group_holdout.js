// What stands between the lights and the lens: a matte or a depth plate, for all lights or for the chosen one.
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
  const files = h('div', { class: 'row', tip: 'A picture in the frame of the shot: a matte, white lets light through; or an EXR depth plate, of which what is nearer than the light hides it.' }, h('label', {}, 'Hidden by'),
    h('div', { class: 'fields' }, button('Matte…', () => pickers.image.click(), { id: 'holdout-image' }), button('Depth…', () => pickers.depth.click(), { id: 'holdout-depth' }), button('None', () => app.deed('set_holdout', { light: light(), values: null }).catch(() => {}), { id: 'holdout-none' }), name, pickers.image, pickers.depth));
  const flip = tick({ label: 'White hides', name: 'holdout_invert', tip: 'The alpha of what stands in front is white where it hides.', get: (s) => here(s)?.invert, set: (invert) => set({ invert }) });
  const unit = entry({ label: 'Depth unit', name: 'depth_unit', tip: 'What a depth of 1 is; 1000 for metres.', unit: 'mm', needed: 'needs a number', get: (s) => here(s)?.depth_unit_mm, set: (depth_unit_mm) => set({ depth_unit_mm }) });
  const over = slider({ label: 'Overscan', name: 'overscan', tip: 'The picture covers so many times the frame, so that lights beside it can be hidden.', min: 1, max: 10, step: 0.01, curve: 2, get: (s) => here(s)?.overscan ?? 1, set: (overscan, held) => set({ overscan }, held) });
  const all = group('What hides lights', [
    choice({ label: 'Of', name: 'holdout_of', tip: 'One picture for all lights, and one more for each.', options: [['all', 'all lights'], ['one', 'the chosen light']], get: () => (whole ? 'all' : 'one'), set: (value) => { whole = value === 'all'; all.update(app.state); } }),
    { element: files, update: (s) => { const found = here(s); name.textContent = (found?.image ?? found?.depth ?? '').split(/[\\/]/).pop(); } },
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
