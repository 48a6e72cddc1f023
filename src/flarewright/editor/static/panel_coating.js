// Coatings: of the whole lens, of one row, and the colours that a ghost can have.
import { latest } from './api.js';
import { button, choice, entry, group, h, refill, slider, stroke } from './ui.js';

const KNOWN = [['lens', 'as the lens file says'], ['none', 'bare glass'], ['quarter-wave:550', 'quarter wave at 550 nm'], ['quarter-wave:450', 'quarter wave at 450 nm'], ['uncoated-1930s', 'uncoated, 1930s'], ['single-1950s', 'single film, 1950s'], ['early-multicoat', 'early multicoat'], ['modern-broadband', 'modern broadband']];
const KINDS = [['none', 'bare glass'], ['quarter-wave', 'quarter wave'], ['film', 'free film'], ['uncoated-1930s', 'uncoated, 1930s'], ['single-1950s', 'single film, 1950s'], ['early-multicoat', 'early multicoat'], ['modern-broadband', 'modern broadband']];
const FIRST = { 'quarter-wave': 'quarter-wave:550', film: 'film:1.38:100' };
// ends of the map, as the server draws it
const LOW = 380;
const HIGH = 750;
// where keys begin on mirrors that wear something else
const MIDDLE = 550;

export function coatingPanel(app) {
  const coat = (text) => app.deed('set_coating', { text }).catch(() => {});
  const whole = group('Whole lens', [
    choice({ label: 'Coating', tip: 'Every glass-air surface gets it. A coating takes light out of some colours; what is left is the colour of the ghosts.', name: 'coating', options: (s) => [...KNOWN, ...(s.lens.presets ?? []).map((name) => [`preset:${name}`, `preset ${name}`]), ['per-row', 'each row its own', true]], get: (s) => s.coating, set: coat }),
    entry({ label: 'Or as text', tip: 'quarter-wave:550, film:1.38:96, stack:1.38:96,2.1:120 and so on: films from the air to the glass.', words: true, name: 'coating_text', get: (s) => s.coating, set: coat }),
  ]);
  const rows = h('div', { class: 'buttons' });
  const field = entry({ label: 'As text', tip: 'none, quarter-wave:NM, film:INDEX:NM, stack:…, or the name of a standard coating.', words: true, name: 'row_coating', get: (s) => line(s)?.coating ?? '', set: (text) => app.deed('set_cell', { row: row(), column: 'coating', text }, '', written).catch(() => {}) });
  // the lens that a text is typed for
  let written = null;
  field.element.addEventListener('focusin', () => { written = app.table(); });
  // what a row wears, taken apart: quarter-wave:NM, film:INDEX:NM, or a text of its own
  const worn = (state, number = row()) => {
    const text = state.lens.rows.find((each) => each.row === number)?.coating || 'none';
    const [kind, ...numbers] = text.split(':');
    const plain = numbers.length === { 'quarter-wave': 1, film: 2 }[kind] && numbers.every((each) => Number.isFinite(Number(each)));
    return plain ? { kind, numbers: numbers.map(Number) } : { kind: KINDS.some(([key]) => key === text) ? text : 'text', numbers: [] };
  };
  const wear = (text, held = '') => app.lively('set_cell', { row: row(), column: 'coating', text }, held, app.table());
  const film = () => { const { kind, numbers } = worn(app.state); return kind === 'film' ? numbers : [1.38, 100]; };
  const kinds = choice({ label: 'Kind', name: 'row_kind', tip: 'One film of a quarter of a wavelength is what lenses of the 1950s wear; a free film takes colours that no such film gives (thesis section 5.4).', options: (s) => (worn(s).kind === 'text' ? [...KINDS, ['text', 'layers, as written below', true]] : KINDS), get: (s) => worn(s).kind, set: (kind) => wear(FIRST[kind] ?? kind) });
  const quarter = slider({ label: 'Wavelength', name: 'row_nm', tip: 'Centre wavelength: it reflects this colour least, so what is left is the opposite one.', min: 300, max: HIGH, step: 2, digits: 0, unit: 'nm', get: (s) => worn(s).numbers[0] ?? 550, set: (nm, held) => wear(`quarter-wave:${nm}`, held) });
  const index = slider({ label: 'Film index', name: 'row_index', tip: 'Magnesium fluoride has 1.38; the nearer to the root of the glass’ index, the less is reflected.', min: 1.2, max: 2.6, step: 0.01, get: () => film()[0], set: (n, held) => wear(`film:${n}:${film()[1]}`, held) });
  const thick = slider({ label: 'Thickness', name: 'row_thickness', tip: 'Of the film: a thicker one reflects more colours in turn.', min: 10, max: 750, step: 1, digits: 0, unit: 'nm', get: () => film()[1], set: (nm, held) => wear(`film:${film()[0]}:${nm}`, held) });
  const plot = h('div', { class: 'plot' });
  const nobody = h('p', { class: 'quietly' }, 'Choose a ghost in the picture: a map will show what colours films on its two mirrors can give it.');
  const mapTold = h('p');
  const mark = h('i');
  const image = h('img', { alt: 'Colours of the ghost by the centre wavelengths of its two mirrors; arrows move along it', draggable: 'false', tabindex: 0 });
  const pair = h('div', { class: 'beside' }, h('div', { class: 'map' }, image, mark), h('div', { class: 'quietly' }, h('p', {}, 'Quarter-wave films on its two mirrors: up, the centre wavelength of the first; to the right, of the second. Click to choose, or go there with the arrows.'), mapTold));
  let seen = '';
  let seenMap = '';

  const surfaces = (state) => state.lens.rows.filter((each) => !each.stop);
  function row() {
    const known = app.state.lens.rows.find((each) => each.row === app.row && !each.stop);
    return known ? known.row : surfaces(app.state)[0]?.row;
  }
  const line = (state) => state.lens.rows.find((each) => each.row === row());
  const drawPlot = latest(async (key) => {
    if (key === seen) return;
    seen = key;
    const answer = await fetch(`/api/coating?row=${row()}`);
    if (!answer.ok) { plot.replaceChildren(h('p', { class: 'quietly' }, (await answer.json()).error)); return; }
    plot.innerHTML = await answer.text();
    plot.querySelector('title')?.remove();
  });
  const at = (event) => {
    const place = image.getBoundingClientRect();
    const nm = (part) => Math.round((LOW + (HIGH - LOW) * Math.max(0, Math.min(1, part))) / 2) * 2;
    return [nm(1 - (event.clientY - place.top) / place.height), nm((event.clientX - place.left) / place.width)];
  };
  // the films that the two mirrors wear, if they are such: whatever put them on, or took them off
  function wornPair(state) {
    const films = app.ghost.split('-').map((number) => worn(state, Number(number)));
    return films.every(({ kind, numbers: [nm] }) => kind === 'quarter-wave' && nm >= LOW && nm <= HIGH) ? films.map(({ numbers: [nm] }) => nm) : null;
  }
  function tellWorn(state) {
    const nms = wornPair(state);
    mark.hidden = !nms;
    // a hand reads there what it points at
    if (!image.matches(':hover')) mapTold.textContent = nms ? pairWords(nms) : '';
    if (!nms) return;
    const [up, right] = nms.map((nm) => 100 * (nm - LOW) / (HIGH - LOW));
    mark.style.left = `${right}%`;
    mark.style.top = `${100 - up}%`;
  }
  const pairWords = (nms) => app.ghost.split('-').map((number, k) => `row ${number}: ${nms[k]} nm`).join(', ');
  image.addEventListener('pointermove', (event) => { mapTold.textContent = pairWords(at(event)); });
  image.addEventListener('pointerleave', () => { if (!pair.hidden) tellWorn(app.state); });
  let asked = 0;
  const put = ([first, second], held) => {
    const [j, i] = app.ghost.split('-');
    asked += 1;
    app.deed('set_row_wavelengths', { values: { [j]: first, [i]: second } }, held).catch(() => {}).finally(() => { asked -= 1; });
  };
  image.addEventListener('click', (event) => put(at(event), ''));
  // keys come faster than answers: they go on from where they were, and that is one step
  let walked = null;
  image.addEventListener('keydown', (event) => {
    const step = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowRight: [0, 1], ArrowLeft: [0, -1] }[event.key];
    if (!step) return;
    event.preventDefault();
    if (!asked) walked = null;
    walked ??= { nms: wornPair(app.state) ?? [MIDDLE, MIDDLE], held: stroke() };
    walked.nms = walked.nms.map((nm, k) => Math.max(LOW, Math.min(HIGH, nm + step[k] * (event.shiftKey ? 50 : 10))));
    put(walked.nms, walked.held);
  });
  return {
    element: h('div', {}, whole.element, h('div', { class: 'group' }, h('h3', {}, 'One row'), rows, kinds.element, quarter.element, index.element, thick.element, field.element), h('div', { class: 'group' }, h('h3', {}, 'Colours of the chosen ghost'), nobody, pair), plot),
    update(state) {
      whole.update(state);
      const here = row();
      refill(rows, surfaces(state).map((each) => button(String(each.row), () => { app.row = each.row; app.panels.coating.update(app.state); }, { kind: each.row === here ? 'on' : '', tip: each.coating || 'no coating' })));
      for (const part of [kinds, quarter, index, thick, field]) part.update(state);
      const { kind } = worn(state);
      quarter.element.hidden = kind !== 'quarter-wave';
      index.element.hidden = thick.element.hidden = kind !== 'film';
      drawPlot(JSON.stringify([here, line(state)]));
      const two = Boolean(app.ghost) && /^\d+-\d+$/.test(app.ghost);
      pair.hidden = !two;
      nobody.hidden = two;
      const key = two ? `${app.ghost}|${state.lens.name}|${JSON.stringify(state.lens.rows.map((each) => each.n_d))}` : '';
      if (two && key !== seenMap) image.src = `/api/map?ghost=${app.ghost}&n=${Date.now()}`;
      if (two) tellWorn(state);
      seenMap = key;
    },
  };
}
