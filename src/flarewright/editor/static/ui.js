// Controls, toasts, dialogs, menus and tooltips. A control reads its value from the state and requests changes.
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (key === 'class') element.className = value;
    // the attribute is forbidden by the page's Content-Security-Policy
    else if (key === 'style') element.style.cssText = value;
    else if (key === 'tip') { element.dataset.tip = value; } else if (value === true) element.setAttribute(key, '');
    else element.setAttribute(key, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

// Replace children; keyboard focus stays at the same position.
export function refill(parent, children) {
  const before = [...parent.children].findIndex((child) => child === document.activeElement);
  parent.replaceChildren(...children);
  if (before >= 0) parent.children[Math.min(before, parent.children.length - 1)]?.focus({ preventScroll: true });
}

let strokes = 0;
export const stroke = () => `s${Date.now().toString(36)}${strokes++}`;

// A toast replaces earlier ones with the same `about`.
export function toast(text, kind = 'info', lasting = kind === 'error' ? 9000 : 4500, about = '') {
  const box = h('div', { class: `toast ${kind}`, 'data-about': about, onclick: () => box.remove() }, text);
  const list = document.getElementById('toasts');
  // drop repetitions, and limit the number
  for (const each of [...list.children]) if (each.textContent === box.textContent || (about && each.dataset.about === about)) each.remove();
  list.append(box);
  // drop errors last
  const dated = () => [...list.children].find((each) => each !== box && !each.classList.contains('error'));
  while (list.children.length > 3) (dated() ?? list.firstChild).remove();
  if (Number.isFinite(lasting)) setTimeout(() => box.remove(), lasting);
}

// `hush` removes outdated errors on a subject,
// `forget` all toasts on it.
export function forget(about) {
  for (const each of [...document.getElementById('toasts').children]) if (each.dataset.about === about) each.remove();
}
export function hush(about) {
  for (const each of [...document.getElementById('toasts').children]) if (each.dataset.about === about && each.classList.contains('error')) each.remove();
}

export function number(text) {
  const value = Number(String(text).replace(',', '.'));
  return Number.isFinite(value) && String(text).trim() !== '' ? value : null;
}

const shown = (value, digits) => (value === null || value === undefined ? '' : String(Number(Number(value).toFixed(digits))));

// Restore the value of a box with unreadable text, and show an error.
function unread(box, label, kept, needed = '') {
  const why = box.value.trim() === '' ? needed || 'needs a number' : `“${box.value.trim()}” is no number`;
  box.value = kept;
  toast(`${label}: ${why}${kept === '' ? '' : `, so it stays ${kept}`}.`, 'error', 9000, `number ${label}`);
}

// A control is {element, update(state)}.
export function group(title, controls, extra = []) {
  const head = title ? h('h3', {}, title, h('span', { class: 'gap' }), ...extra) : null;
  const element = h('div', { class: 'group', role: title ? 'group' : null, 'aria-label': title || null }, head, ...controls.map((control) => control.element ?? control));
  return { element, update: (state) => controls.forEach((control) => control.update?.(state)) };
}

export function row(label, tip, fields, update) {
  fields[0].id ||= `c${strokes++}`;
  const { id } = fields[0];
  const element = h('div', { class: 'row', tip }, h('label', { for: id }, label), h('div', { class: 'fields' }, ...fields));
  return { element, update };
}

// Number of steps that a key moves a slider; Home and End move it to an end.
const KEY_STEPS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10, Home: -Infinity, End: Infinity };

// A slider with a number box. `set` receives the value and a group, so that one stroke is one step of the history;
// `skip` maps a value reached by keys to a valid one; `log`: from `min` to `max` in equal factors.
export function slider({ label, tip, get, set, min, max, step = 0.01, digits = 2, unit = '', curve = 1, name, skip = (value) => value, log = false }) {
  // the bar's own value is a part of its length, which says nothing to a screen reader
  const say = () => bar.setAttribute('aria-valuetext', `${box.value} ${unit}`.trim());
  const to = (value) => (log ? Math.log(Math.max(value, min) / min) / Math.log(max / min) : Math.pow(Math.max(0, (value - min) / (max - min)), 1 / curve));
  const from = (part) => (log ? min * (max / min) ** part : min + (max - min) * Math.pow(part, curve));
  const written = (value) => (log && value !== null ? String(Number(value.toPrecision(3))) : shown(value, digits));
  const bar = h('input', { type: 'range', min: 0, max: 1, step: curve === 1 && !log ? step / (max - min) : 0.001, 'aria-label': label });
  const box = h('input', { class: 'number small', type: 'text', inputmode: 'decimal', 'aria-label': label, name });
  let held = null;
  let kept = null;
  let reported = null;
  // keep the user's value until the server has answered
  let asked = 0;
  const ask = (value, group) => {
    asked += 1;
    Promise.resolve(set(value, group)).finally(() => { asked -= 1; show(); });
  };
  const rounded = (value) => (log ? Number(value.toPrecision(4)) : Number((Math.round(value / step) * step).toFixed(6)));
  bar.addEventListener('pointerdown', () => { held = stroke(); });
  bar.addEventListener('keydown', (event) => {
    const by = KEY_STEPS[event.key] * (event.shiftKey ? 10 : 1);
    if (!by) return;
    // the browser steps the bar; with a curve that may be less than one step of the value, without effect
    event.preventDefault();
    held ??= stroke();
    const next = log ? (Math.max(kept ?? min, min)) * 2 ** (by / 10) : (kept ?? min) + by * step;
    kept = skip(Math.max(min, Math.min(max, rounded(next))), by);
    bar.value = to(kept);
    box.value = written(kept);
    say();
    ask(kept, held);
  });
  bar.addEventListener('keyup', () => { held = null; });
  bar.addEventListener('input', () => {
    const value = rounded(from(Number(bar.value)));
    box.value = written(value);
    say();
    ask(value, held ?? '');
  });
  bar.addEventListener('change', () => { held = null; });
  box.addEventListener('change', () => {
    const value = number(box.value);
    if (value === null) unread(box, label, written(kept)); else ask(value, '');
  });
  escapes(box, () => written(kept));
  function show() {
    if (asked || !reported) return;
    kept = get(reported);
    if (!bar.matches(':active')) bar.value = to(kept ?? min);
    if (document.activeElement !== box) { box.value = written(kept); say(); }
  }
  return row(label, tip, [bar, box, h('span', { class: 'unit' }, unit)], (state) => { reported = state; show(); });
}

// `needed`: error for an empty box; without it, empty is a valid value.
export function entry({ label, tip, get, set, digits = 4, unit = '', placeholder = '', words = false, needed = '', name, list }) {
  const box = h('input', { class: words ? '' : 'number', type: 'text', placeholder, name, list, spellcheck: 'false' });
  let kept = '';
  box.addEventListener('change', () => {
    const text = box.value.trim();
    const value = words ? text : text === '' ? null : number(text);
    if (text === '' ? needed : value === null) unread(box, label, kept, needed); else set(value);
  });
  escapes(box, () => kept);
  return row(label, tip, [box, h('span', { class: 'unit' }, unit)], (state) => {
    const value = get(state);
    kept = words ? value ?? '' : shown(value, digits);
    if (document.activeElement !== box) box.value = kept;
  });
}

function escapes(box, text) {
  box.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') { box.value = text(); box.blur(); event.stopPropagation(); }
    if (event.key === 'Enter') box.blur();
  });
}

export function choice({ label, tip, get, set, options, name }) {
  const box = h('select', { name });
  let listed = '';
  const element = row(label, tip, [box, h('span', { class: 'unit' })], (state) => {
    const all = typeof options === 'function' ? options(state) : options;
    const value = String(get(state) ?? '');
    const whole = all.some(([key]) => key === value) ? all : [...all, [value, value]];
    const text = JSON.stringify(whole);
    if (text !== listed) {
      box.replaceChildren(...whole.map(([key, words, off]) => h('option', { value: key, disabled: off }, words)));
      listed = text;
    }
    if (document.activeElement !== box || box.value !== value) box.value = value;
  });
  box.addEventListener('change', () => set(box.value));
  return element;
}

// `off` returns why the box is disabled; empty: enabled.
export function tick({ label, tip, get, set, name, off = () => '' }) {
  const box = h('input', { type: 'checkbox', name });
  const why = h('span', { class: 'unit' });
  // keep the user's value until the server has answered
  let asked = 0;
  box.addEventListener('change', async () => {
    asked += 1;
    try { await set(box.checked); } finally { asked -= 1; }
  });
  return row(label, tip, [box, why], (state) => {
    if (!asked) box.checked = Boolean(get(state));
    why.textContent = off(state);
    box.disabled = Boolean(why.textContent);
  });
}

export const button = (words, work, { tip, kind = '', ...rest } = {}) =>
  h('button', { class: kind, tip, onclick: work, type: 'button', ...rest }, words);

// Show whether a button is on, to eyes and to screen readers.
export function press(element, on) {
  element.classList.toggle('on', on);
  element.setAttribute('aria-pressed', on);
  return element;
}

export function dialog(title, ...content) {
  const box = h('dialog', { 'aria-label': title }, h('h2', {}, title), ...content);
  box.addEventListener('close', () => box.remove());
  // a click beside the dialog closes it; its own padding, and the end of a drag that began within, do not
  const beside = (event) => {
    const { left, top, right, bottom } = box.getBoundingClientRect();
    return event.target === box && (event.clientX < left || event.clientX > right || event.clientY < top || event.clientY > bottom);
  };
  let pressed = false;
  box.addEventListener('pointerdown', (event) => { pressed = beside(event); });
  box.addEventListener('click', (event) => { if (pressed && beside(event)) box.close(); });
  document.body.append(box);
  box.showModal();
  return box;
}

export function menu(anchor, entries) {
  document.querySelector('.menu')?.remove();
  const place = anchor.getBoundingClientRect();
  const box = h('div', { class: 'menu', role: 'menu' }, ...entries.map(([words, work, tip]) =>
    h('button', { role: 'menuitem', type: 'button', tip, onclick: () => { box.remove(); anchor.focus(); work(); } }, words)));
  box.style.left = `${place.left}px`;
  box.style.top = `${place.bottom + 3}px`;
  document.body.append(box);
  box.firstChild?.focus();
  const shut = (event) => {
    const entry = [...box.children].indexOf(document.activeElement);
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (box.isConnected && step) { event.preventDefault(); event.stopPropagation(); box.children[(entry + step + box.children.length) % box.children.length].focus(); return; }
    if (box.isConnected && event.type === 'keydown' && !['Escape', 'Tab'].includes(event.key)) return;
    if (event.type === 'pointerdown' && box.contains(event.target)) return;
    if (event.type === 'keydown' && box.isConnected) { anchor.focus(); if (event.key === 'Escape') event.stopPropagation(); }
    box.remove();
    removeEventListener('pointerdown', shut, true);
    removeEventListener('keydown', shut, true);
  };
  addEventListener('pointerdown', shut, true);
  addEventListener('keydown', shut, true);
}

// Tooltips, for the mouse after a delay and for keyboard focus at once.
export function tips() {
  let timer = 0;
  const box = h('div', { id: 'tip', role: 'tooltip', hidden: true });
  document.body.append(box);
  const show = (element) => {
    box.textContent = element.dataset.tip;
    box.hidden = false;
    const place = element.getBoundingClientRect();
    const own = box.getBoundingClientRect();
    const panel = document.getElementById('panel');
    // left of the panel, so that it covers no control
    if (panel.contains(element) && !element.closest('#tabs')) {
      box.style.left = `${panel.getBoundingClientRect().left - own.width - 8}px`;
      box.style.top = `${Math.min(place.top, innerHeight - own.height - 8)}px`;
      return;
    }
    if (element.closest('.menu')) {
      // beside the menu, so that it covers no entry
      box.style.left = `${place.right + 10}px`;
      box.style.top = `${place.top}px`;
      return;
    }
    const left = Math.min(place.left, innerWidth - own.width - 8);
    const below = place.bottom + 6 + own.height < innerHeight;
    box.style.left = `${Math.max(8, left)}px`;
    box.style.top = `${below ? place.bottom + 6 : place.top - own.height - 6}px`;
  };
  addEventListener('pointerover', (event) => {
    clearTimeout(timer);
    box.hidden = true;
    const element = event.target.closest?.('[data-tip]');
    if (element) timer = setTimeout(() => { if (element.isConnected) show(element); }, 550);
  });
  const hide = () => { clearTimeout(timer); box.hidden = true; };
  addEventListener('pointerdown', hide);
  addEventListener('focusout', (event) => { hide(); event.target.removeAttribute('aria-describedby'); });
  addEventListener('focusin', (event) => {
    const element = event.target.matches(':focus-visible') ? event.target.closest('[data-tip]') : null;
    if (element) { show(element); event.target.setAttribute('aria-describedby', box.id); } else box.hidden = true;
  });
}
