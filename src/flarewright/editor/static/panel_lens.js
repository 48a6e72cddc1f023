// The prescription: an editable table with remarks on its cells.
import { complain, get, latest, post, sentence } from './api.js';
import { button, entry, group, h } from './ui.js';

const COLUMNS = [
  ['radius', 'Radius', 'Radius of curvature, mm: positive when its centre lies behind the surface; "flat" for a plane.'],
  ['thickness', 'Gap', 'Distance to the next surface, mm.'],
  ['glass', 'Glass', 'Glass behind the surface: a catalogue name, or empty for air.'],
  ['n_d', 'n_d', 'Index at 587.6 nm: it determines refraction, and the reflection of bare glass.'],
  ['v_d', 'V_d', 'Abbe number: a smaller one means more dispersion.'],
  ['semi_diameter', 'Semi', 'Half the clear diameter, mm: rims clip ghosts. In italics: estimated.'],
  ['coating', 'Coating', 'none, quarter-wave:550, film:1.38:96, early-multicoat… Good coatings make faint ghosts.'],
];
// wide enough for the shown digits and a usual coating
const WIDTHS = ['22px', '56px', '52px', '51px', '52px', '52px', '45px', ''];
const NAMES = ['glass', 'coating'];

export function lensPanel(app) {
  const body = h('tbody');
  const head = h('tr', {}, h('th', {}, '#'), ...COLUMNS.map(([column, words, tip]) => h('th', { scope: 'col', tip, class: NAMES.includes(column) ? 'name' : null }, words)));
  const table = h('table', { class: 'rows', style: 'table-layout:fixed' }, h('colgroup', {}, ...WIDTHS.map((width) => h('col', { style: width ? `width:${width}` : '' }))), h('thead', {}, head), body);
  const wrong = h('div', { class: 'wrong', role: 'alert' });
  // stays visible below a long table
  const notes = h('div', { class: 'group quietly notes' });
  const glasses = h('datalist', { id: 'glasses' });
  const facts = h('div', { class: 'facts' });
  const source = h('p', { class: 'quietly' });
  let refused = null;
  // the last edited row: its remarks stay visible when the focus moves to the next row
  let written = null;
  let drawn = '';
  const search = latest(async (words) => { glasses.replaceChildren(...(await get(`api/glasses?q=${encodeURIComponent(words)}`)).glasses.map((name) => h('option', { value: name }))); });

  async function write(row, column, text, table) {
    refused = null;
    drawn = '';
    written = { row, table };
    try { await app.commandQuietly('set_cell', { row, column, text }, table); wrong.textContent = ''; } catch (error) {
      const state = await get('api/state').catch(() => null);
      if (!state) {
        // no connection: nothing was written
        complain(error);
        draw(app.state);
        return;
      }
      // the table that is drawn next shows what was refused, unless the cell does not exist any more
      refused = state.lens.table === table ? { row, column, text, why: sentence(error.message) } : null;
      app.take(state);
      if (app.table() !== table) { refused = null; drawn = ''; }
      draw(app.state);
      wrong.textContent = sentence(error.message);
    }
  }
  function mark(box) {
    box.classList.add('bad');
    box.dataset.tip = refused.why;
    wrong.textContent = refused.why;
  }
  function cell(line, column) {
    const table = app.table();
    const note = line.notes[column];
    const guess = column === 'semi_diameter' && line.estimated;
    // round an estimate to the digits that fit
    const value = guess ? Number(line[column]).toFixed(2) : line[column] ?? '';
    const box = h('input', { type: 'text', value, tip: note, class: `${note ? 'note' : ''} ${guess ? 'guess' : ''}`, 'aria-label': `Row ${line.row}, ${COLUMNS.find(([key]) => key === column)[1]}`, 'data-row': line.row, 'data-column': column, spellcheck: 'false', list: column === 'glass' ? 'glasses' : null });
    if (refused && refused.row === line.row && refused.column === column) { box.value = refused.text; box.defaultValue = refused.text; mark(box); }
    box.addEventListener('focus', () => { app.row = line.row; choose(); if (column === 'glass') search(box.value); box.select(); });
    box.addEventListener('input', () => { if (column === 'glass') search(box.value); });
    box.addEventListener('change', () => { const text = box.value; box.defaultValue = text; write(line.row, column, text, table); });
    box.addEventListener('keydown', (event) => {
      if (event.key === 'Escape') { refused = null; wrong.textContent = ''; box.value = value; box.defaultValue = value; box.classList.remove('bad'); drawn = ''; box.blur(); draw(app.state); event.stopPropagation(); }
      const step = { ArrowDown: 1, ArrowUp: -1, Enter: 1 }[event.key];
      if (step && !(column === 'glass' && event.key !== 'Enter')) {
        event.preventDefault();
        const next = body.querySelector(`input[data-row="${line.row + step}"][data-column="${column}"]`);
        if (next) next.focus(); else box.blur();
      }
    });
    return h('td', { class: NAMES.includes(column) ? 'name' : '' }, box);
  }
  function draw(state) {
    const key = JSON.stringify([state.lens.table, state.lens.rows, state.lens.facts.stop]);
    if (key === drawn && !refused) return;
    const active = document.activeElement;
    const here = active && body.contains(active) && active.dataset.column ? { row: active.dataset.row, column: active.dataset.column } : null;
    // keep a field while the user types in it; redraw the table afterwards
    if (here && active.value !== active.defaultValue) { active.addEventListener('blur', () => draw(app.state), { once: true }); return; }
    drawn = key;
    body.replaceChildren(...state.lens.rows.map((line) => {
      const first = h('td', { onclick: () => { app.row = line.row; choose(); app.panels.coating.rowChosen?.(); }, tip: Object.values(line.notes).join(' ') || null }, String(line.row));
      if (line.stop) {
        const [box] = [cell(line, 'thickness')];
        return h('tr', { class: 'stop', 'data-line': line.row }, first, h('td', { style: 'padding:0 4px' }, 'stop'), box, h('td', { colspan: 5, style: 'text-align:left;padding-left:6px' }, `ø ${state.lens.facts.stop ? state.lens.facts.stop.toFixed(2) : '–'} mm at this f-number`));
      }
      return h('tr', { 'data-line': line.row }, first, ...COLUMNS.map(([column]) => cell(line, column)));
    }));
    choose();
    if (here) {
      const box = body.querySelector(`input[data-row="${here.row}"][data-column="${here.column}"]`);
      if (box) box.focus();
    }
  }
  function choose() {
    for (const line of body.children) line.classList.toggle('chosen', Number(line.dataset.line) === app.row);
    const line = app.state?.lens.rows.find((each) => each.row === app.row);
    const other = written && written.table === app.state?.lens.table && written.row !== app.row ? app.state.lens.rows[written.row] : null;
    const reported = (one, where) => Object.entries(one?.notes ?? {}).map(([column, words]) => h('div', {}, `${where}${COLUMNS.find(([key]) => key === column)?.[1] ?? column}: ${words}`));
    notes.replaceChildren(...reported(other, `row ${written?.row}, `), ...reported(line, ''));
    for (const each of [add, copy, remove, stop]) each.disabled = !line;
    if (line) { copy.disabled = remove.disabled = stop.disabled = line.stop; }
  }
  const rowCommand = (name) => () => app.command(name, { row: app.row }, '', app.table).catch(() => {});
  const add = button('Add row', rowCommand('add_row'), { tip: 'Insert a plane surface behind the chosen row, in the middle of its gap.', id: 'add-row' });
  const copy = button('Duplicate', rowCommand('duplicate_row'), { tip: 'Insert a copy of the chosen row behind it.' });
  const remove = button('Remove', rowCommand('remove_row'), { id: 'remove-row', tip: 'Remove the chosen row; the gap in front of it absorbs its thickness.' });
  const stop = button('Stop here', rowCommand('move_stop'), { id: 'move-stop', tip: 'Move the iris into the air in front of the chosen row, or behind it if glass is in front. Sharpness is unchanged, but other rays pass, so the ghosts change their size.' });
  const own = group('Lens', [
    entry({ label: 'Name', tip: 'Name of the lens.', words: true, needed: 'a lens needs a name', name: 'lens_name', get: (s) => s.lens.name, set: (name) => app.command('set_lens_facts', { values: { name } }).catch(() => {}) }),
    entry({ label: 'Wide open', tip: 'The smallest f-number: determines the largest stop diameter.', name: 'open', needed: 'needs a number', get: (s) => s.lens.open, set: (f_number) => app.command('set_lens_facts', { values: { f_number } }).catch(() => {}) }),
  ]);
  app.commandQuietly = async (name, values, table) => {
    await app.line(async () => app.take(await post('api/do', { name, values, table })));
  };
  const picker = h('input', { type: 'file', accept: '.toml,.lens,.zmx,.seq,.len,.dat,.csv,.json', hidden: true });
  picker.addEventListener('change', async () => { if (picker.files[0]) await app.importFile(picker.files[0]); picker.value = ''; });
  return {
    element: h('div', {}, own.element, h('div', { class: 'group' }, facts, source, h('div', { class: 'buttons' }, add, copy, remove, stop, button('Import…', () => picker.click(), { tip: 'A lens file; it can also be dropped on the page.' })), picker), table, wrong, notes, glasses),
    update(state) {
      own.update(state);
      const f = state.lens.facts;
      const say = (label, value, unit = ' mm') => h('span', {}, `${label} `, h('b', {}, value === undefined ? '–' : `${Number(value.toPrecision(6))}${unit}`));
      facts.replaceChildren(say('focal length', f.efl), say('f/', f.f_number, ''), say('back focus', f.bfl), say('sensor at', f.sensor_distance), say('entrance pupil', f.entrance_pupil));
      source.textContent = state.lens.problem ? sentence(state.lens.problem) : state.lens.source;
      draw(state);
    },
  };
}
