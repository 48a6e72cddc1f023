// The table of ghosts, and overrides of the chosen one.
import { button, group, h, press, row, slider } from './ui.js';

const COLUMNS = [['name', 'Ghost', 'First mirror – second mirror, rows counted from the front.'], ['share', 'Light', 'Its light in the picture, relative to the brightest ghost.'], ['size', 'Size', 'Root mean square radius in the picture, mm.']];

export function ghostPanel(app) {
  let by = 'share';
  let down = true;
  const body = h('tbody');
  const heads = COLUMNS.map(([key, words, tip]) => h('th', { class: 'sort', scope: 'col', tip, tabindex: 0, style: key === 'share' ? 'text-align:left' : null, onclick: () => order(key), onkeydown: (event) => { if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); order(key); } } }, words));
  const table = h('table', { class: 'ghosts' }, h('thead', {}, h('tr', {}, ...heads, h('th', { scope: 'col' }, 'Override'))), body);
  const reported = h('span');
  const order = (key) => { down = by === key ? !down : key !== 'name'; by = key; draw(); };
  const rowNumber = (name) => name.split('-').reduce((sum, part) => sum * 1000 + (part === 'sensor' ? 999 : Number(part)), 0);
  const sorted = () => [...app.ghosts.ghosts].sort((a, b) => (by === 'name' ? rowNumber(a.name) - rowNumber(b.name) : a[by] - b[by]) * (down ? -1 : 1));
  const chosen = () => app.ghosts.ghosts.find((ghost) => ghost.name === app.ghost);
  const solos = () => app.state.solo;
  const setGhost = (values, held = '') => {
    const ghost = chosen();
    if (!ghost) return null;
    // what the server answers where no other rule changes this ghost
    const { gain, tint } = { ...ghost, ...values };
    Object.assign(ghost, values, { whole: { gain, tint } });
    return app.lively('set_ghost', { name: app.ghost, values }, held);
  };
  const tint = h('input', { type: 'color' });
  const hex = (rgb) => `#${rgb.map((part) => Math.round(255 * Math.min(1, part) ** (1 / 2.2)).toString(16).padStart(2, '0')).join('')}`;
  const white = (rgb) => rgb.every((part) => part === 1);
  tint.addEventListener('change', () => {
    const linear = [1, 3, 5].map((k) => Number(((parseInt(tint.value.slice(k, k + 2), 16) / 255) ** 2.2).toFixed(4)));
    setGhost({ tint: linear });
  });
  const controls = group('Chosen ghost', [
    slider({ label: 'Gain', tip: 'Factor on the light of this ghost; 1 is physical.', min: 0, max: 20, step: 0.01, curve: 3, name: 'ghost_gain', get: () => chosen()?.gain ?? 1, set: (gain, held) => setGhost({ gain }, held) }),
    row('Tint', 'Factor on its colour; white is physical. For a colour by real coatings, use the Coating panel.', [tint, button('White', () => setGhost({ tint: [1, 1, 1] }), { kind: 'quiet' })], () => { tint.value = hex(chosen()?.tint ?? [1, 1, 1]); }),
  ]);
  const solo = button('Solo', () => self.solo(), { tip: 'Show this ghost alone (S).', id: 'solo' });
  const mute = button('Mute', () => self.mute(), { tip: 'Hide this ghost (M).', id: 'mute' });
  const reset = button('Reset', () => app.command('reset_art', {}).catch(() => {}), { tip: 'Remove all gains, tints, mutes and solos.' });
  const head = h('div', { class: 'group' }, h('h3', {}, 'Ghosts', h('span', { class: 'gap' }), reported), h('div', { class: 'buttons' }, solo, mute, reset));

  function line(ghost) {
    const muted = ghost.muted || (solos().length > 0 && !solos().includes(ghost.name));
    const bar = h('span', { class: 'bar' });
    bar.style.width = `${Math.max(1, 110 * Math.sqrt(ghost.share))}px`;
    const element = h('tr', { class: `${ghost.name === app.ghost ? 'chosen' : ''} ${muted ? 'muted' : ''}`, 'data-ghost': ghost.name, 'aria-selected': String(ghost.name === app.ghost), tabindex: -1 },
      h('td', {}, ghost.name), h('td', { style: 'text-align:left' }, bar, ` ${(100 * ghost.share).toPrecision(2) < 0.01 ? '<0.01' : Number((100 * ghost.share).toPrecision(2))} %`), h('td', {}, ghost.size.toFixed(2)),
      h('td', {}, ghost.muted ? 'muted' : ghost.whole.gain !== 1 ? `× ${Number(ghost.whole.gain.toPrecision(3))}` : '', white(ghost.whole.tint) ? null : h('i', { class: 'tint', style: `background:${hex(ghost.whole.tint)}`, title: 'tinted' })));
    element.addEventListener('click', () => app.choose(ghost.name === app.ghost ? null : ghost.name));
    element.addEventListener('keydown', (event) => {
      if (event.key === 'Enter') app.choose(ghost.name);
      const next = { ArrowDown: element.nextSibling, ArrowUp: element.previousSibling }[event.key];
      if (next) { event.preventDefault(); next.focus(); }
    });
    // keyboard focus shows the same outline as the mouse
    element.addEventListener('focus', () => { reached(element); if (element.matches(':focus-visible')) app.view.hoverGhost(ghost.name); });
    element.addEventListener('blur', () => app.view.hoverGhost(null));
    element.addEventListener('pointerenter', () => { element.classList.add('over'); app.view.hoverGhost(ghost.name); });
    element.addEventListener('pointerleave', () => { element.classList.remove('over'); app.view.hoverGhost(null); });
    return element;
  }
  function reached(element) {
    for (const each of body.querySelectorAll('[tabindex="0"]')) each.tabIndex = -1;
    if (element) element.tabIndex = 0;
  }
  function draw() {
    heads.forEach((head_, k) => {
      const sorting = by === COLUMNS[k][0];
      head_.textContent = COLUMNS[k][1] + (sorting ? (down ? ' ▾' : ' ▴') : '');
      head_.setAttribute('aria-sort', sorting ? (down ? 'descending' : 'ascending') : 'none');
    });
    const held = document.activeElement?.dataset?.ghost;
    body.replaceChildren(...sorted().map(line));
    // one stop of the Tab key; arrows step through a zoom's hundreds of ghosts
    reached([...body.children].find((each) => each.dataset.ghost === app.ghost) ?? body.firstChild);
    // keep the keyboard focus on the ghost when the order changes
    if (held !== undefined) [...body.children].find((each) => each.dataset.ghost === held)?.focus({ preventScroll: true });
    body.querySelector('.chosen')?.scrollIntoView({ block: 'nearest' });
  }
  const self = {
    element: h('div', {}, head, controls.element, table),
    update(state) {
      const mine = chosen();
      reported.textContent = app.ghosts.fresh ? `${app.ghosts.ghosts.length} in the picture` : 'being measured…';
      controls.element.hidden = !mine;
      if (mine) controls.update(state);
      solo.disabled = mute.disabled = !app.ghost;
      press(solo, Boolean(app.ghost) && state.solo.includes(app.ghost));
      press(mute, Boolean(mine?.muted));
      reset.disabled = !state.by_hand;
      draw();
    },
    solo() { if (app.ghost) app.command('set_solo', { names: solos().includes(app.ghost) ? [] : [app.ghost] }).catch(() => {}); else if (solos().length) app.command('set_solo', { names: [] }).catch(() => {}); },
    mute() { const ghost = chosen(); if (ghost) setGhost({ muted: !ghost.muted }); },
    step(by_) {
      const names = sorted().map((ghost) => ghost.name);
      if (!names.length) return;
      const at = names.indexOf(app.ghost);
      app.choose(names[at < 0 ? 0 : (at + by_ + names.length) % names.length]);
    },
  };
  return self;
}
