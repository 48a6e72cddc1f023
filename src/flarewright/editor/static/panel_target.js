// Targets and search: how ghosts should look, and lenses that make them so.
import { button, choice, entry, group, h, press, refill, row, slider, tick, toast } from './ui.js';

const COMPARE = [
  ['physical', 'Physical', 'The picture of the present lens (W cycles through these four).'], ['target', 'Target', 'The picture with all targets met, drawn by matrices; no lens makes it yet.'],
  ['wipe', 'Wipe', 'Target to the right of a line that you can drag.'], ['side', 'Side by side', 'Both: the physical picture by traced rays, the target by matrices.'],
];

// the server's limit
const MOST_SECONDS = 3600;
const offAxis = ({ lights }) => Math.max(...lights.map(({ field_deg }) => Math.atan(Math.hypot(...field_deg.map((deg) => Math.tan(deg * Math.PI / 180)))) * 180 / Math.PI));
const matrices = (state) => `The target is drawn by matrices, which are exact near the axis; the light is ${offAxis(state).toFixed(0)}° off it. With the angle, physical ghosts differ more from it in place, shape and brightness, also those without a target.`;

export function targetPanel(app) {
  const ghostTargets = () => app.state.design?.ghost_targets ?? [];
  const own = () => app.view.places.find((one) => one.name === app.ghost);
  const mine = () => (app.ghostTarget !== null ? ghostTargets()[app.ghostTarget] : ghostTargets().find((ghostTarget) => ghostTarget.ghost === app.ghost));
  const set = (values, held = '') => (app.ghostTarget !== null
    ? app.lively('set_new_ghost_target', { number: app.ghostTarget, values }, held)
    : app.ghost && app.lively('set_ghost_target', { ghost: app.ghost, values }, held));
  const compare = h('div', { class: 'buttons', role: 'group', 'aria-label': 'What is shown' });
  const looks = COMPARE.map(([key, words, tip]) => button(words, () => see(key), { 'data-compare': key, tip }));
  compare.append(...looks);
  const see = (key) => { app.view.see(key); self.update(app.state); app.view.redraw(); };
  const drawn = h('p', { class: 'quietly', id: 'target-drawn' });
  const list = h('div', { class: 'buttons' });
  const reported = h('p', { class: 'quietly' });
  const colour = h('input', { type: 'color', value: '#ffffff' });
  colour.addEventListener('change', () => set({ color: [1, 3, 5].map((k) => Number(((parseInt(colour.value.slice(k, k + 2), 16) / 255) ** 2.2).toFixed(4))) }));
  const drop = button('Remove ghost', () => set({ action: mine()?.action === 'remove' ? 'want' : 'remove' }), { tip: 'Target: the ghost is invisible.', id: 'ghost-target-remove' });
  const ignore = button('Any', () => set({ action: mine()?.action === 'ignore' ? 'want' : 'ignore' }), { tip: 'No target for this ghost: the solver may change it freely.' });
  const removeTarget = (number) => app.command('remove_ghost_target', { number, before: app.state.design.before_added ?? app.state.design.before_scratch });
  const back = button('Remove target', () => (app.ghostTarget !== null ? removeTarget(app.ghostTarget).then(() => { app.ghostTarget = null; }) : removeTarget(ghostTargets().indexOf(mine()))).catch(() => {}), { kind: 'quiet', id: 'ghost-target-back', tip: 'Remove the target of this ghost.' });
  const fields = group('Target of the ghost', [
    slider({ label: 'Move', tip: 'Along the line from the middle of the picture to the light, mm: all ghosts of a lens of revolution lie on it.', min: -20, max: 20, step: 0.05, unit: 'mm', name: 'target_move', get: () => (app.ghostTarget !== null ? app.view.targetPlace(app.ghostTarget) : mine()?.move_mm) ?? 0, set: (value, held) => set(app.ghostTarget !== null ? { place_mm: value, at_mm: null, move_mm: 0 } : { move_mm: value }, held) }),
    slider({ label: 'Size ×', tip: 'Factor on its radius. Its flux is constant, so a smaller ghost is brighter.', min: 0.05, max: 5, step: 0.01, curve: 2, name: 'target_size', get: () => mine()?.height ?? 1, set: (height, held) => set({ height }, held) }),
    row('Colour', 'Its hue; Solve colours searches coatings for it.', [colour, button('Keep', () => set({ color: null }), { kind: 'quiet' })], () => { colour.value = mine()?.color ? `#${mine().color.map((part) => Math.round(255 * Math.min(1, part) ** (1 / 2.2)).toString(16).padStart(2, '0')).join('')}` : '#ffffff'; }),
    h('div', { class: 'buttons' }, drop, ignore, back),
  ]);
  const design = (values) => app.command('set_design', { values }).catch(() => {});
  const how = group('Solve', [
    choice({ label: 'Search among', tip: 'Lenses built like this one have the same order of glass, air and stop; any structure may change it.', name: 'structure', options: [['lens', 'lenses built like this one'], ['any', 'any structure']], get: (s) => s.design?.structure ?? 'lens', set: (structure) => design({ structure }) }),
    tick({ label: 'From scratch', tip: 'Search for the added ghosts only, without the lens’ own ghosts (thesis section 5.7).', name: 'scratch', off: (s) => (s.design?.ghost_targets.some((ghostTarget) => !ghostTarget.ghost) ? '' : 'add a ghost first'), get: (s) => s.design?.own_ghosts === false, set: (scratch) => design(scratch ? { own_ghosts: false, structure: 'any' } : { own_ghosts: true, ...app.state.design.before_scratch }) }),
    entry({ label: 'Surfaces', tip: 'Number of surfaces of the new lens; empty: as many as this lens has, or as the ghosts need.', placeholder: 'as needed', digits: 0, get: (s) => s.design?.surfaces, set: (surfaces) => design({ surfaces, ...(surfaces ? { structure: 'any' } : {}) }) }),
  ]);
  let seconds = 20;
  const time = entry({ label: 'Seconds', tip: 'Time of the search. It can be stopped earlier; the best lenses so far are kept.', digits: 0, name: 'seconds', needed: 'needs a number', get: () => seconds, set: (value) => {
    seconds = Math.max(1, Math.min(MOST_SECONDS, Math.round(value)));
    if (seconds !== value) toast(`${value} s became ${seconds} s: whole seconds from 1 to ${MOST_SECONDS} are possible.`, 'info', 9000, 'seconds');
    time.update(app.state);
  } });
  // results are shown below the settings: scroll to them with the first picture and with the last,
  // unless the user has scrolled meanwhile
  let awaited = false;
  let left = null;
  const search = (path, values) => { awaited = true; left = null; return app.ask(path, { ...values, seconds }); };
  function intoSight(run) {
    const page = document.getElementById('page');
    if (!awaited || !run.found.length || app.tab !== 'target') return;
    if (left === null || left === page.scrollTop) solve.parentElement.scrollIntoView({ block: 'start' });
    left = page.scrollTop;
    awaited = run.running;
  }
  const solve = button('Solve', () => search('api/solve'), { kind: 'main', id: 'solve', tip: 'Search lenses whose ghosts meet the targets; the best so far are shown below.' });
  const colors = button('Solve colours', () => search('api/colors', { kind: 'quarter-wave' }), { tip: 'Search quarter-wave coatings for all rows that give ghosts their target colours and keep the colours of the others.', id: 'solve-colors' });
  const films = button('…with free films', () => search('api/colors', { kind: 'film' }), { tip: 'Films of any index and thickness: more colours, but less realistic.' });
  const stop = button('Stop', app.stopSolving, { id: 'stop', tip: 'End the search and keep the best.' });
  const clear = button('Remove all', () => app.command('clear_ghost_targets', {}).catch(() => {}), { kind: 'quiet', tip: 'Remove all targets; the lens stays.' });
  const add = button('Add a ghost', () => app.command('add_ghost', { place_mm: 5 - 4 * (ghostTargets().filter((ghostTarget) => !ghostTarget.ghost).length % 5), radius_mm: 1.5 }).then(() => app.chooseGhostTarget(ghostTargets().length - 1)).catch(() => {}), { tip: 'Add a target for a new ghost; drag it along the line.', id: 'ghost-target-add' });
  // why a button is disabled
  const needed = h('p', { class: 'quietly', id: 'solve-needs' });
  const progress = h('p', { class: 'quietly', id: 'solve-words' });
  const found = h('div', { class: 'candidates' });

  async function accept(number) {
    const state = await app.ask('api/accept', { number });
    if (!state) return;
    see('physical');
    toast(state.reported, 'good', 15000, 'accept');
  }

  const self = {
    element: h('div', {}, h('div', { class: 'group' }, h('h3', {}, 'Target'), compare, drawn, reported, list, h('div', { class: 'buttons' }, add, clear)), fields.element, how.element, h('div', { class: 'group' }, time.element, h('div', { class: 'buttons' }, solve, stop, colors, films), needed, progress, found)),
    shown() { if (app.state) app.places?.(); },
    next() { const keys = COMPARE.map(([key]) => key); see(keys[(keys.indexOf(app.view.compare) + 1) % keys.length]); },
    update(state) {
      for (const look of looks) press(look, look.dataset.compare === app.view.compare);
      drawn.hidden = app.view.compare === 'physical';
      drawn.textContent = matrices(state);
      const chosen = app.ghostTarget !== null || Boolean(own());
      reported.textContent = app.ghost && !own() && app.ghostTarget === null ? app.view.unplaced || `Ghost ${app.ghost} reflects on both sides of the stop; design can move those that reflect twice on one side.`
        : chosen ? 'Drag it along the line, or its rim to resize it.' : 'Click a ghost to set its target.';
      refill(list, (state.design?.ghost_targets ?? []).map((ghostTarget, number) => press(button(state.design.names[number], () => (ghostTarget.ghost ? app.choose(ghostTarget.ghost) : app.chooseGhostTarget(number))), ghostTarget.ghost ? ghostTarget.ghost === app.ghost && app.ghostTarget === null : number === app.ghostTarget)));
      fields.element.hidden = !chosen;
      if (chosen) fields.update(state);
      press(drop, mine()?.action === 'remove');
      press(ignore, mine()?.action === 'ignore');
      drop.disabled = app.ghostTarget !== null;
      back.disabled = !mine();
      clear.disabled = !state.design;
      how.update(state);
      time.update(state);
      const run = state.solve;
      const wanted = ghostTargets().length > 0;
      const coloured = ghostTargets().some((ghostTarget) => ghostTarget.color);
      solve.disabled = run.running || !wanted;
      colors.disabled = films.disabled = run.running || !coloured;
      needed.textContent = wanted ? (coloured ? '' : 'Solve colours needs a ghost with a target colour.') : 'No targets yet: choose a ghost and set its target, or add a ghost; then solve.';
      stop.disabled = !run.running;
      progress.textContent = run.words ? `${run.words}${run.seconds ? ` · ${run.seconds.toFixed(0)} s` : ''}` : '';
      // replace results only if they differ; redrawn pictures keep the keyboard focus
      const key = JSON.stringify([run.running, run.found]);
      const pictures = `${run.number} ${run.found.length}`;
      if (found.dataset.key === key && found.dataset.pictures !== pictures) found.querySelectorAll('img').forEach((image, k) => { image.src = `api/candidate/${k}?n=${run.number}`; });
      found.dataset.pictures = pictures;
      if (found.dataset.key !== key) {
        found.dataset.key = key;
        found.replaceChildren(...run.found.map((words, k) => h('figure', {}, h('img', { src: `api/candidate/${k}?n=${run.number}`, alt: words }), h('figcaption', {}, words,
          button('Accept', () => accept(k), { kind: 'main', disabled: run.running, 'data-accept': k })))));
        intoSight(run);
      }
    },
  };
  return self;
}
