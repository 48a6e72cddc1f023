// Annotate and solve: what the ghosts shall be, and the lenses that make them so.
import { button, choice, entry, group, h, refill, row, slider, tick, toast } from './ui.js';

const COMPARE = [
  ['physical', 'Physical', 'What the lens does (W walks through these four).'], ['target', 'Target', 'The picture as it is wished for, drawn by matrices: no lens makes it yet.'],
  ['wipe', 'Wipe', 'Target to the right of a line that can be dragged.'], ['side', 'Side by side', 'Both at once: the physical one by traced rays, the target by matrices.'],
];

// as the server has it
const MOST_SECONDS = 3600;
const offAxis = ({ lights }) => Math.max(...lights.map(({ field_deg }) => Math.atan(Math.hypot(...field_deg.map((deg) => Math.tan(deg * Math.PI / 180)))) * 180 / Math.PI));
const matrices = (state) => `The target is drawn by matrices, which are true near the axis; the light stands ${offAxis(state).toFixed(0)}° off it. The farther, the more the physical ghosts differ from it in place, shape and brightness, also those of which nothing is wished.`;

export function targetPanel(app) {
  const wishes = () => app.state.design?.wishes ?? [];
  const own = () => app.view.places.find((one) => one.name === app.ghost);
  const mine = () => (app.wish !== null ? wishes()[app.wish] : wishes().find((wish) => wish.ghost === app.ghost));
  const set = (values, held = '') => (app.wish !== null
    ? app.lively('set_new_wish', { number: app.wish, values }, held)
    : app.ghost && app.lively('set_wish', { ghost: app.ghost, values }, held));
  const compare = h('div', { class: 'buttons', role: 'group', 'aria-label': 'What is shown' });
  const looks = COMPARE.map(([key, words, tip]) => button(words, () => see(key), { 'data-compare': key, tip }));
  compare.append(...looks);
  const see = (key) => { app.view.see(key); self.update(app.state); app.view.redraw(); };
  const drawn = h('p', { class: 'quietly', id: 'target-drawn' });
  const list = h('div', { class: 'buttons' });
  const told = h('p', { class: 'quietly' });
  const colour = h('input', { type: 'color', value: '#ffffff' });
  colour.addEventListener('change', () => set({ color: [1, 3, 5].map((k) => Number(((parseInt(colour.value.slice(k, k + 2), 16) / 255) ** 2.2).toFixed(4))) }));
  const drop = button('Remove ghost', () => set({ action: mine()?.action === 'remove' ? 'want' : 'remove' }), { tip: 'It shall not be seen at all.', id: 'wish-remove' });
  const ignore = button('Any', () => set({ action: mine()?.action === 'ignore' ? 'want' : 'ignore' }), { tip: 'Whatever becomes of this ghost is fine; the solver is freer.' });
  const takeBack = (number) => app.deed('remove_wish', { number, before: app.state.design.before_added ?? app.state.design.before_scratch });
  const back = button('Take back', () => (app.wish !== null ? takeBack(app.wish).then(() => { app.wish = null; }) : takeBack(wishes().indexOf(mine()))).catch(() => {}), { kind: 'quiet', id: 'wish-back', tip: 'Forget what was wished of this ghost.' });
  const fields = group('What it shall be', [
    slider({ label: 'Move', tip: 'Along the line from the middle of the picture to the light, mm: no ghost of a lens of revolution can leave it.', min: -20, max: 20, step: 0.05, unit: 'mm', name: 'wish_move', get: () => (app.wish !== null ? mine()?.place_mm : mine()?.move_mm) ?? 0, set: (value, held) => set(app.wish !== null ? { place_mm: value } : { move_mm: value }, held) }),
    slider({ label: 'Size ×', tip: 'Of its radius. Its light stays, so a smaller ghost is brighter.', min: 0.05, max: 5, step: 0.01, curve: 2, name: 'wish_size', get: () => mine()?.height ?? 1, set: (height, held) => set({ height }, held) }),
    row('Colour', 'Its hue; Solve colours then looks for coatings that give it.', [colour, button('As it is', () => set({ color: null }), { kind: 'quiet' })], () => { colour.value = mine()?.color ? `#${mine().color.map((part) => Math.round(255 * Math.min(1, part) ** (1 / 2.2)).toString(16).padStart(2, '0')).join('')}` : '#ffffff'; }),
    h('div', { class: 'buttons' }, drop, ignore, back),
  ]);
  const design = (values) => app.deed('set_design', { values }).catch(() => {});
  const how = group('Solve', [
    choice({ label: 'Search among', tip: 'Lenses built like this one keep glass, air and stop where they are; any structure may put them elsewhere.', name: 'structure', options: [['lens', 'lenses built like this one'], ['any', 'any structure']], get: (s) => s.design?.structure ?? 'lens', set: (structure) => design({ structure }) }),
    tick({ label: 'From scratch', tip: 'Only the ghosts that were added count; the lens’ own are left out (thesis section 5.7).', name: 'scratch', off: (s) => (s.design?.wishes.some((wish) => !wish.ghost) ? '' : 'add a ghost first, for it to aim at'), get: (s) => s.design?.own_ghosts === false, set: (scratch) => design(scratch ? { own_ghosts: false, structure: 'any' } : { own_ghosts: true, ...app.state.design.before_scratch }) }),
    entry({ label: 'Surfaces', tip: 'Of the new lens; empty: as many as this one, or as the ghosts need.', placeholder: 'as needed', digits: 0, get: (s) => s.design?.surfaces, set: (surfaces) => design({ surfaces, ...(surfaces ? { structure: 'any' } : {}) }) }),
  ]);
  let seconds = 20;
  const time = entry({ label: 'Seconds', tip: 'Stop it any time; the best lenses so far are kept.', digits: 0, name: 'seconds', needed: 'needs a number', get: () => seconds, set: (value) => {
    seconds = Math.max(1, Math.min(MOST_SECONDS, Math.round(value)));
    if (seconds !== value) toast(`${value} s became ${seconds} s: a search takes whole seconds from 1 to ${MOST_SECONDS}.`, 'info', 9000, 'seconds');
    time.update(app.state);
  } });
  // what is searched is shown below what was asked for: it comes into sight with its first picture and with its last,
  // unless a hand has scrolled meanwhile
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
  const solve = button('Solve', () => search('/api/solve'), { kind: 'main', id: 'solve', tip: 'Search lenses whose ghosts are where they are wished to be; the best so far are shown below.' });
  const colors = button('Solve colours', () => search('/api/colors', { kind: 'quarter-wave' }), { tip: 'Quarter-wave coatings for all rows, so that ghosts get the wished colours and the others keep theirs.', id: 'solve-colors' });
  const films = button('…with free films', () => search('/api/colors', { kind: 'film' }), { tip: 'Films of any index and thickness: more colours, less like real lenses.' });
  const stop = button('Stop', app.stopSolving, { id: 'stop', tip: 'End the search and keep the best.' });
  const clear = button('Take all back', () => app.deed('clear_wishes', {}).catch(() => {}), { kind: 'quiet', tip: 'Forget all wishes; the lens stays.' });
  const add = button('Add a ghost', () => app.deed('add_ghost', { place_mm: 5 - 4 * (wishes().filter((wish) => !wish.ghost).length % 5), radius_mm: 1.5 }).then(() => app.chooseWish(wishes().length - 1)).catch(() => {}), { tip: 'One that the lens has not; drag it along the line.', id: 'wish-add' });
  // why a button cannot be pressed
  const needed = h('p', { class: 'quietly', id: 'solve-needs' });
  const progress = h('p', { class: 'quietly', id: 'solve-words' });
  const found = h('div', { class: 'candidates' });

  async function accept(number) {
    const state = await app.ask('/api/accept', { number });
    if (!state) return;
    see('physical');
    toast(state.told, 'good', 15000, 'accept');
  }

  const self = {
    element: h('div', {}, h('div', { class: 'group' }, h('h3', {}, 'Target'), compare, drawn, told, list, h('div', { class: 'buttons' }, add, clear)), fields.element, how.element, h('div', { class: 'group' }, time.element, h('div', { class: 'buttons' }, solve, stop, colors, films), needed, progress, found)),
    shown() { if (app.state) app.places?.(); },
    next() { const keys = COMPARE.map(([key]) => key); see(keys[(keys.indexOf(app.view.compare) + 1) % keys.length]); },
    update(state) {
      for (const look of looks) look.classList.toggle('on', look.dataset.compare === app.view.compare);
      drawn.hidden = app.view.compare === 'physical';
      drawn.textContent = matrices(state);
      const chosen = app.wish !== null || Boolean(own());
      told.textContent = app.ghost && !own() && app.wish === null ? `Ghost ${app.ghost} reflects on both sides of the stop; design moves those that reflect twice on one side.`
        : chosen ? 'Drag it along the line, or its rim to resize it.' : 'Click a ghost to say what it shall become.';
      refill(list, (state.design?.wishes ?? []).map((wish, number) => button(state.design.names[number], () => (wish.ghost ? app.choose(wish.ghost) : app.chooseWish(number)), { kind: (wish.ghost ? wish.ghost === app.ghost && app.wish === null : number === app.wish) ? 'on' : '' })));
      fields.element.hidden = !chosen;
      if (chosen) fields.update(state);
      drop.classList.toggle('on', mine()?.action === 'remove');
      ignore.classList.toggle('on', mine()?.action === 'ignore');
      drop.disabled = app.wish !== null;
      back.disabled = !mine();
      clear.disabled = !state.design;
      how.update(state);
      time.update(state);
      const run = state.solve;
      const wished = wishes().length > 0;
      const coloured = wishes().some((wish) => wish.color);
      solve.disabled = run.running || !wished;
      colors.disabled = films.disabled = run.running || !coloured;
      needed.textContent = wished ? (coloured ? '' : 'Solve colours needs a ghost that was given a colour.') : 'Nothing is wished for yet: choose a ghost and say what it shall be, or add one; then solve.';
      stop.disabled = !run.running;
      progress.textContent = run.words ? `${run.words}${run.seconds ? ` · ${run.seconds.toFixed(0)} s` : ''}` : '';
      // with another lens what was found goes; what is only drawn anew leaves the keyboard where it was
      const key = JSON.stringify([run.running, run.found]);
      const pictures = `${run.number} ${run.found.length}`;
      if (found.dataset.key === key && found.dataset.pictures !== pictures) found.querySelectorAll('img').forEach((image, k) => { image.src = `/api/candidate/${k}?n=${run.number}`; });
      found.dataset.pictures = pictures;
      if (found.dataset.key !== key) {
        found.dataset.key = key;
        found.replaceChildren(...run.found.map((words, k) => h('figure', {}, h('img', { src: `/api/candidate/${k}?n=${run.number}`, alt: words }), h('figcaption', {}, words,
          button('Accept', () => accept(k), { kind: 'main', disabled: run.running, 'data-accept': k })))));
        intoSight(run);
      }
    },
  };
  return self;
}
