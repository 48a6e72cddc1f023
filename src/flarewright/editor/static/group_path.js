// The timeline of a light's path.
import { button, h, number as parsed, toast } from './ui.js';

// keys lie at hundredths of a second
const HALF_STEP_S = 0.0051;
// the latest time of a key
const LAST_S = 86400;

// The number of the key that has the first possible of some times.
const numberAt = (times, keys) => times.map((at_s) => keys.findIndex((key) => Math.abs(key.at_s - at_s) < HALF_STEP_S)).find((one) => one >= 0);

export function pathGroup(app) {
  const { player } = app;
  const span = () => Math.max(5, Math.ceil(app.state?.path_s ?? 0), Math.ceil(player.at));
  const keys = () => app.state.lights[app.light].keys;
  const bar = h('input', { type: 'range', min: 0, step: 0.01, value: 0, name: 'path_at', 'aria-label': 'Time on the path, seconds', tip: 'Time on the path: drafts while the slider moves, the final picture when it rests.' });
  const box = h('input', { class: 'number', type: 'text', inputmode: 'decimal', name: 'path_time', 'aria-label': 'Time, seconds', tip: 'Go to a time, also after the last key, to set the next key there.', style: 'width:56px' });
  const marks = h('div', { class: 'marks' });
  const body = h('tbody');
  const table = h('table', { class: 'keys' }, h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, 'Seconds'), h('th', { scope: 'col' }, 'Right °'), h('th', { scope: 'col' }, 'Up °'), h('th'))), body);
  const play = button('▶ Play', () => player.toggle(), { id: 'path-play', tip: 'Play the path; the light stays where playback stops, as a step that undo reverts (T).' });
  const key = button('Key', () => player.key(), { id: 'path-key', tip: 'Set a key: the present place of the light at this time (K).' });
  const loop = h('input', { type: 'checkbox', name: 'path_loop' });
  const clear = button('Remove path', () => app.command('clear_keys', { light: app.light }).catch(() => {}), { kind: 'quiet', id: 'path-clear', tip: 'Remove all keys of this light; it stays where it is.' });
  const reported = h('p', { class: 'quietly' });
  loop.addEventListener('change', () => player.setLoop(loop.checked));
  bar.addEventListener('input', () => player.scrub(Number(bar.value)));
  bar.addEventListener('change', () => player.rest());
  box.addEventListener('change', () => {
    const value = parsed(box.value);
    if (value === null) toast(`Time: “${box.value}” is no number, so it stays ${player.at.toFixed(2)} s.`, 'error', 9000, 'path time');
    else if (value < 0) toast(`${value} s became 0 s: a path starts there.`, 'info', 9000, 'path time');
    else if (value > LAST_S) toast(`${value} s became ${LAST_S} s: a path ends within a day.`, 'info', 9000, 'path time');
    if (value !== null) player.go(Math.min(value, LAST_S));
    // also while the box has the focus, when no answer rewrites it
    box.value = player.at.toFixed(2);
  });
  box.addEventListener('keydown', (event) => { if (event.key === 'Enter') box.blur(); });
  let drawn = '';
  // the light and the times of the key of a row
  const keyOf = new WeakMap();

  function mark(each, k) {
    const place = `calc(8px + (100% - 16px) * ${each.at_s / span()})`;
    const element = h('button', { type: 'button', class: 'mark', style: `left:${place}`, 'aria-label': `Key at ${each.at_s} s`, tip: `${each.at_s} s. Click to go there, drag to another time.` });
    let held = null;
    let dragged = false;
    element.addEventListener('pointerdown', (event) => { element.setPointerCapture(event.pointerId); dragged = false; held = { x: event.clientX }; });
    element.addEventListener('pointermove', (event) => {
      if (!held || (!dragged && Math.abs(event.clientX - held.x) < 4)) return;
      dragged = true;
      const room = marks.getBoundingClientRect();
      held.at = Math.max(0, Math.min(span(), (event.clientX - room.left - 8) / (room.width - 16) * span()));
      element.style.left = `${event.clientX - room.left}px`;
    });
    element.addEventListener('pointerup', () => {
      if (dragged) app.command('move_key', { light: app.light, number: k, at_s: Number(held.at.toFixed(2)) }).catch(() => { drawn = ''; });
      held = null;
    });
    element.addEventListener('click', () => { if (!dragged) player.go(each.at_s); });
    return element;
  }
  function line(each, k) {
    const cell = (value, name, set) => {
      const kept = String(Number(value.toFixed(3)));
      const field = h('input', { type: 'text', value: kept, 'aria-label': `${name} of key ${k + 1}`, name: `key_${name}_${k}` });
      const back = () => { drawn = ''; field.value = kept; field.defaultValue = kept; };
      field.addEventListener('change', () => {
        const found = parsed(field.value);
        field.defaultValue = field.value;
        if (found !== null) { set(found).catch(back); return; }
        toast(`“${field.value}” is no number, so it stays ${kept}.`, 'error', 9000, `key ${name}`);
        back();
      });
      field.addEventListener('keydown', (event) => { if (event.key === 'Enter') field.blur(); if (event.key === 'Escape') { back(); field.blur(); event.stopPropagation(); } });
      return h('td', {}, field);
    };
    // the times the key has or was asked to have: an answer may be on its way, and a refused move leaves it in place
    const { light } = app;
    const times = [each.at_s];
    const change = (name, valuesOf) => app.command(name, () => {
      const now = app.state.lights[light]?.keys ?? [];
      const number = numberAt(times, now);
      return number === undefined ? null : { light, ...valuesOf(now[number], number) };
    });
    const move = (at_s) => change('move_key', (_, number) => { times.push(at_s); return { number, at_s }; });
    const place = (axis, angle) => change('set_key', (key) => ({ at_s: key.at_s, field_deg: key.field_deg.with(axis, angle) }));
    const remove = () => change('remove_key', (_, number) => ({ number })).catch(() => {});
    const element = h('tr', {}, cell(each.at_s, 'seconds', move),
      cell(each.field_deg[0], 'right', (value) => place(0, value)), cell(each.field_deg[1], 'up', (value) => place(1, value)),
      h('td', {}, button('×', remove, { kind: 'quiet', 'aria-label': `Remove key ${k + 1}`, name: `key_remove_${k}` })));
    keyOf.set(element, { light, times });
    return element;
  }
  // Focus the same field of the same key again, which may be in another row; without the key, that of the same row.
  // What was selected, as by the Tab key, is selected again: typing replaces it.
  function focusAgain(field) {
    const [, name, row] = field.name.match(/^(\w+)_(\d+)$/);
    const { light, times } = keyOf.get(field.closest('tr'));
    const number = (light === app.light ? numberAt(times, keys()) : undefined) ?? Math.min(Number(row), keys().length - 1);
    const again = body.querySelector(`[name=${name}_${number}]`);
    again?.focus();
    if (field.selectionEnd > field.selectionStart) again?.select();
  }
  function tick() {
    play.textContent = player.playing ? '■ Stop' : '▶ Play';
    play.classList.toggle('on', player.playing);
    loop.checked = player.loop;
    bar.max = span();
    if (!bar.matches(':active')) bar.value = player.at;
    if (document.activeElement !== box) box.value = player.at.toFixed(2);
  }
  player.heard = tick;
  const element = h('div', { class: 'group path' }, h('h3', {}, 'Path of the light'),
    h('div', { class: 'buttons' }, play, key, h('label', { tip: 'Restart at time 0 after the last key.' }, loop, ' Loop'), box, h('span', { class: 'quietly' }, 's'), h('span', { class: 'gap' }), clear),
    marks, bar, reported, table);
  return {
    element,
    update(state) {
      const mine = keys();
      play.disabled = !(state.path_s > 0);
      clear.disabled = !mine.length;
      table.hidden = !mine.length;
      reported.textContent = mine.length > 1 ? '' : mine.length ? 'Choose another time, move the light, and press Key again.' : 'Move the light to the start of its path and press Key.';
      tick();
      const now = JSON.stringify([app.light, mine, span()]);
      if (now === drawn) return;
      const active = body.contains(document.activeElement) ? document.activeElement : null;
      // keep a field while the user types in it
      if (active?.matches('input') && active.value !== active.defaultValue) return;
      drawn = now;
      marks.replaceChildren(...mine.map(mark));
      body.replaceChildren(...mine.map(line));
      if (active) focusAgain(active);
    },
  };
}
