// Coatings: of the whole lens, of one row, and the possible colours of a ghost.
import { latest } from './api.js';
import { button, choice, entry, group, h, press, refill, slider, stroke } from './ui.js';

const KNOWN = [['lens', 'as in the lens file'], ['none', 'bare glass'], ['quarter-wave:550', 'quarter wave at 550 nm'], ['quarter-wave:450', 'quarter wave at 450 nm'], ['uncoated-1930s', 'uncoated, 1930s'], ['single-1950s', 'single film, 1950s'], ['early-multicoat', 'early multicoat'], ['modern-broadband', 'modern broadband']];
const KINDS = [['none', 'bare glass'], ['quarter-wave', 'quarter wave'], ['film', 'free film'], ['uncoated-1930s', 'uncoated, 1930s'], ['single-1950s', 'single film, 1950s'], ['early-multicoat', 'early multicoat'], ['modern-broadband', 'modern broadband']];
const FIRST = { 'quarter-wave': 'quarter-wave:550', film: 'film:1.38:100' };
// range of the map, as the server draws it
const LOW = 380;
const HIGH = 750;
// start of the arrow keys on mirrors with another coating
const MIDDLE = 550;

export function coatingPanel(app) {
  const coat = (text) => app.command('set_coating', { text }).catch(() => {});
  const whole = group('Whole lens', [
    choice({ label: 'Coating', tip: 'Coating of every glass-air surface. It reduces the reflection of some colours; the remaining reflection colours the ghosts.', name: 'coating', options: (s) => [...KNOWN, ...(s.lens.presets ?? []).map((name) => [`preset:${name}`, `preset ${name}`]), ['per-row', 'differs by row', true]], get: (s) => s.coating, set: coat }),
    entry({ label: 'Or as text', tip: 'quarter-wave:550, film:1.38:96, stack:1.38:96,2.1:120 and so on: films from air to glass.', words: true, name: 'coating_text', get: (s) => s.coating, set: coat }),
  ]);
  const rows = h('div', { class: 'buttons' });
  const field = entry({ label: 'As text', tip: 'none, quarter-wave:NM, film:INDEX:NM, stack:…, or the name of a standard coating.', words: true, name: 'row_coating', get: (s) => line(s)?.coating ?? '', set: (text) => app.command('set_cell', { row: row(), column: 'coating', text }, '', written).catch(() => {}) });
  // the lens for which the text is typed
  let written = null;
  field.element.addEventListener('focusin', () => { written = app.table(); });
  // parse the coating of a row: quarter-wave:NM, film:INDEX:NM, or another text
  const worn = (state, number = row()) => {
    const text = state.lens.rows.find((each) => each.row === number)?.coating || 'none';
    const [kind, ...numbers] = text.split(':');
    const plain = numbers.length === { 'quarter-wave': 1, film: 2 }[kind] && numbers.every((each) => Number.isFinite(Number(each)));
    return plain ? { kind, numbers: numbers.map(Number) } : { kind: KINDS.some(([key]) => key === text) ? text : 'text', numbers: [] };
  };
  const wear = (text, held = '') => app.lively('set_cell', { row: row(), column: 'coating', text }, held, app.table());
  const film = () => { const { kind, numbers } = worn(app.state); return kind === 'film' ? numbers : [1.38, 100]; };
  const kinds = choice({ label: 'Kind', name: 'row_kind', tip: 'Lenses of the 1950s have one quarter-wave film; a free film gives colours that no quarter-wave film can (thesis section 5.4).', options: (s) => (worn(s).kind === 'text' ? [...KINDS, ['text', 'layers, as written below', true]] : KINDS), get: (s) => worn(s).kind, set: (kind) => wear(FIRST[kind] ?? kind) });
  const quarter = slider({ label: 'Wavelength', name: 'row_nm', tip: 'Centre wavelength: this colour is reflected least, so the reflection has the complementary colour.', min: 300, max: HIGH, step: 2, digits: 0, unit: 'nm', get: (s) => worn(s).numbers[0] ?? 550, set: (nm, held) => wear(`quarter-wave:${nm}`, held) });
  const index = slider({ label: 'Film index', name: 'row_index', tip: 'Magnesium fluoride has 1.38; the closer to the square root of the glass’ index, the weaker the reflection.', min: 1.2, max: 2.6, step: 0.01, get: () => film()[0], set: (n, held) => wear(`film:${n}:${film()[1]}`, held) });
  const thick = slider({ label: 'Thickness', name: 'row_thickness', tip: 'Thickness of the film: the reflectance of a thicker film oscillates faster over the wavelengths.', min: 10, max: 750, step: 1, digits: 0, unit: 'nm', get: () => film()[1], set: (nm, held) => wear(`film:${film()[0]}:${nm}`, held) });
  const plot = h('div', { class: 'plot' });
  const noGhost = h('p', { class: 'quietly' }, 'Choose a ghost in the picture to see the colours that films on its two mirrors can give it.');
  const mapText = h('p');
  const mark = h('i');
  const image = h('img', { alt: 'Colours of the ghost by the centre wavelengths of its two mirrors; arrows move along it', draggable: 'false', tabindex: 0 });
  const pair = h('div', { class: 'beside' }, h('div', { class: 'map' }, image, mark), h('div', { class: 'quietly' }, h('p', {}, 'Quarter-wave films on its two mirrors: centre wavelength of the first upwards, of the second to the right. Click or use the arrow keys to choose.'), mapText));
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
    const answer = await fetch(`api/coating?row=${row()}`);
    if (!answer.ok) { plot.replaceChildren(h('p', { class: 'quietly' }, (await answer.json()).error)); return; }
    plot.innerHTML = await answer.text();
    plot.querySelector('title')?.remove();
  });
  const at = (event) => {
    const place = image.getBoundingClientRect();
    const nm = (part) => Math.round((LOW + (HIGH - LOW) * Math.max(0, Math.min(1, part))) / 2) * 2;
    return [nm(1 - (event.clientY - place.top) / place.height), nm((event.clientX - place.left) / place.width)];
  };
  // centre wavelengths of the two mirrors if both have quarter-wave films in the map's range, else null
  function pairWavelengths(state) {
    const films = app.ghost.split('-').map((number) => worn(state, Number(number)));
    return films.every(({ kind, numbers: [nm] }) => kind === 'quarter-wave' && nm >= LOW && nm <= HIGH) ? films.map(({ numbers: [nm] }) => nm) : null;
  }
  function showWorn(state) {
    const nms = pairWavelengths(state);
    mark.hidden = !nms;
    // while the pointer is over the map, the text shows the place under it
    if (!image.matches(':hover')) mapText.textContent = nms ? pairWords(nms) : '';
    if (!nms) return;
    const [up, right] = nms.map((nm) => 100 * (nm - LOW) / (HIGH - LOW));
    mark.style.left = `${right}%`;
    mark.style.top = `${100 - up}%`;
  }
  const pairWords = (nms) => app.ghost.split('-').map((number, k) => `row ${number}: ${nms[k]} nm`).join(', ');
  image.addEventListener('pointermove', (event) => { mapText.textContent = pairWords(at(event)); });
  image.addEventListener('pointerleave', () => { if (!pair.hidden) showWorn(app.state); });
  let asked = 0;
  const put = ([first, second], held) => {
    const [j, i] = app.ghost.split('-');
    asked += 1;
    app.command('set_row_wavelengths', { values: { [j]: first, [i]: second } }, held).catch(() => {}).finally(() => { asked -= 1; });
  };
  image.addEventListener('click', (event) => put(at(event), ''));
  // keys repeat faster than answers: continue from the last place, as one step of the history
  let walked = null;
  image.addEventListener('keydown', (event) => {
    const step = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowRight: [0, 1], ArrowLeft: [0, -1] }[event.key];
    if (!step) return;
    event.preventDefault();
    if (!asked) walked = null;
    walked ??= { nms: pairWavelengths(app.state) ?? [MIDDLE, MIDDLE], held: stroke() };
    walked.nms = walked.nms.map((nm, k) => Math.max(LOW, Math.min(HIGH, nm + step[k] * (event.shiftKey ? 50 : 10))));
    put(walked.nms, walked.held);
  });
  return {
    element: h('div', {}, whole.element, h('div', { class: 'group' }, h('h3', {}, 'One row'), rows, kinds.element, quarter.element, index.element, thick.element, field.element), h('div', { class: 'group' }, h('h3', {}, 'Colours of the chosen ghost'), noGhost, pair), plot),
    update(state) {
      whole.update(state);
      const here = row();
      refill(rows, surfaces(state).map((each) => press(button(String(each.row), () => { app.row = each.row; app.panels.coating.update(app.state); }, { 'aria-label': `Row ${each.row}`, tip: each.coating || 'no coating' }), each.row === here)));
      for (const part of [kinds, quarter, index, thick, field]) part.update(state);
      const { kind } = worn(state);
      quarter.element.hidden = kind !== 'quarter-wave';
      index.element.hidden = thick.element.hidden = kind !== 'film';
      // the light reaches a cemented row through the glass of the row before
      drawPlot(JSON.stringify([here, line(state), state.lens.rows.find((each) => each.row === here - 1)]));
      const two = Boolean(app.ghost) && /^\d+-\d+$/.test(app.ghost);
      pair.hidden = !two;
      noGhost.hidden = two;
      const key = two ? `${app.ghost}|${state.lens.name}|${JSON.stringify(state.lens.rows.map((each) => each.n_d))}` : '';
      if (two && key !== seenMap) image.src = `api/map?ghost=${app.ghost}&n=${Date.now()}`;
      if (two) showWorn(state);
      seenMap = key;
    },
  };
}
