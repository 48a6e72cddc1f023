// The page: one state from the server, shown by panels; every change is a command that the server runs or rejects.
import { LOST, complain, get, inLine, inWords, latest, post, sentence, socketAddress, under } from './api.js';
import { fitted } from './section.js';
import { button, dialog, forget, h, hush, menu, press, stroke, tips, toast, slider } from './ui.js';
import { viewport } from './viewport.js';
import { coatingPanel } from './panel_coating.js';
import { ghostPanel } from './panel_ghosts.js';
import { irisPanel } from './panel_iris.js';
import { lensPanel } from './panel_lens.js';
import { libraryPanel } from './panel_library.js';
import { lightPanel } from './panel_light.js';
import { panelOfLens } from './of_lens.js';
import { player } from './player.js';
import { targetPanel } from './panel_target.js';

// the cookie has the token from now on; keep it out of the history
history.replaceState(null, '', location.pathname);
const app = { state: null, light: 0, ghost: null, ghostTarget: null, ghosts: { fresh: false, ghosts: [] }, tab: 'light', row: null };
window.flarewright = app;
app.player = player(app);
app.under = under;
const $ = (id) => document.getElementById(id);

// ------------------------------------------------------------------------------------------------------------- state
// Keys of the parts of the last server state on which pictures depend; drags write into the page's state earlier.
const ghostsOf = (s) => JSON.stringify([s.lens.name, s.lens.rows.map((row) => row.stop)]);
const placesOf = (s) => JSON.stringify([s.lights, s.lens, s.camera, s.iris, s.view.grey, s.view.unclipped]);
// display settings of the target picture, shared with the picture
const seenOf = (s) => JSON.stringify([s.view.look, s.view.stops, s.plate, s.view.plate_shown, s.view.plate_stops, s.view.grey, s.view.unclipped]);
const shotOf = (s) => JSON.stringify([s.lights, s.lens, s.camera, s.iris, s.dirt, s.coating, s.pass_gain, s.by_hand, s.view.grey, s.view.unclipped]);
let known = {};
// the server's state, without the page's pending changes
let plain = null;
let plainGhosts = null;
function take(state) {
  if (app.state && state.revision < app.state.revision) return;
  const old = app.state;
  // a picture event may arrive before an older answer
  if (old && old.picture.number > state.picture.number) state.picture = old.picture;
  plain = structuredClone(state);
  Object.assign(state.view, asked);
  app.state = state;
  // after undo, the chosen light may have another number
  const chosen = old?.lights[app.light]?.name;
  const named = state.lights.flatMap((light, k) => (light.name === chosen ? [k] : []));
  app.light = named.length === 1 ? named[0] : Math.min(app.light, state.lights.length - 1);
  // end a drag whose light was removed: its number may be that of another light now
  const dragged = app.view.drag?.light;
  if (old && dragged !== undefined && old.lights[dragged]?.name !== state.lights[dragged]?.name) { app.view.drag = null; app.view.letGo(); }
  const before = known;
  known = { ghosts: ghostsOf(state), places: placesOf(state), shot: shotOf(state), design: JSON.stringify(state.design), seen: seenOf(state) };
  // another lens, or other row numbers, make other ghosts
  if (old && before.ghosts !== known.ghosts) {
    Object.assign(app, { ghost: null, ghostTarget: null, ghosts: { fresh: false, ghosts: [] } });
    plainGhosts = null;
    app.hint();
  }
  // the target of a new ghost may be undone
  if (app.ghostTarget !== null && state.design?.ghost_targets[app.ghostTarget]?.ghost !== null) app.ghostTarget = null;
  if (before.places !== known.places) app.view.forget();
  if (before.ghosts !== known.ghosts) app.view.unplaced = 'Finding the ghosts that design can move…';
  // reset the player for another project
  if (old && old.opened !== state.opened) app.player.reset();
  const moved = !old || before.shot !== known.shot;
  if (moved) {
    app.view.outline = null;
    // after a drag the picture has priority
    if (app.view.released) app.view.afterwards = drawSection; else drawSection();
  }
  if (moved || before.design !== known.design) app.places();
  if (moved || before.design !== known.design || before.seen !== known.seen) app.view.refreshTarget();
  update();
  if (state.picture.number !== app.view.shownNumber) app.view.refresh(Boolean(old));
}
app.take = take;
// Restore the server's state: drop changes that were rejected or lost.
app.back = () => {
  if (!plain) return;
  const { picture, solve, finding } = app.state ?? plain;
  app.state = Object.assign(structuredClone(plain), { picture, solve, finding });
  Object.assign(app.state.view, asked);
  if (plainGhosts) app.ghosts = structuredClone(plainGhosts);
  update();
};
export const reload = latest(async () => take(await get('api/state')));

function update() {
  const state = app.state;
  for (const part of parts) part.update?.(state);
  app.refreshPanel();
  $('problem').hidden = !state.picture.problem;
  $('problem').textContent = state.picture.problem ? `${sentence(state.picture.problem)}${state.picture.grade ? ' The last good picture is shown.' : ''}` : '';
  document.title = `${state.clean ? '' : '• '}${fileName(state)} – Flarewright`;
  status();
  app.view.redraw();
}
app.refreshPanel = () => {
  panels[app.tab].update?.(app.state);
  // during a drag, show the angles of the drag
  const { live, lights } = app.view.mover;
  if (live && lights) writeLights(lights);
};
const fileName = (state) => (state.file ? state.file.split(/[\\/]/).pop() : state.lens.name);

// Over a plate whose lights are those of the project, flare and plate have one exposure.
const stopsOf = (s) => (s.plate?.lit ? s.view.plate_stops : s.view.stops);
const expose = (stops) => app.setView(app.state.plate?.lit ? { plate_stops: stops } : { exposure_stops: stops });
const autoExpose = () => (app.state.plate?.lit ? app.setView({ plate_stops: 0 }) : app.ask('api/expose'));

// All changes of the project go through one queue, so that the last change wins, and save, undo and search use what
// the page shows. Values that keep a part of the state (an angle, a side) are a function: it runs when their turn comes,
// because an earlier change may still be on its way, and returns null when what it changes is gone.
const line = inLine();
app.line = line;
app.command = async (name, values, group = '', table = null, stroke = '') => {
  const about = `command ${name}`;
  try {
    await line(async () => {
      const given = typeof values === 'function' ? values() : values;
      if (!given) return;
      const state = await post('api/do', { name, values: given, group, table: typeof table === 'function' ? table() : table });
      hush(about);
      take(state);
      if (state.became) toast(sentence(state.became), 'info', 9000, about);
    }, stroke);
  } catch (error) { complain(error, about); app.back(); reload(); loadGhosts(); throw error; }
};
// identifies the shown rows: a command on one of them must not apply to another lens
app.table = () => app.state.lens.table;
// For sliders, which change faster than the server answers: only the newest value is sent.
app.lively = (name, values, group, table = null) => app.command(name, values, group, table, group).catch(() => {});
// Keys repeat faster than answers: the page applies values at once, and sends all of them.
let asked = {};
const sendView = latest(async () => {
  const values = asked;
  asked = {};
  if (!Object.keys(values).length) return;
  try { take(await post('api/view', values)); hush('view'); } catch (error) { complain(error, 'view'); app.back(); reload(); }
});
app.setView = (values) => {
  Object.assign(asked, values);
  Object.assign(app.state.view, values);
  if (Number.isFinite(values.exposure_stops)) app.state.view.stops = values.exposure_stops;
  return sendView();
};
app.ask = async (path, body) => {
  try {
    return await line(async () => {
      const state = await post(path, body);
      hush(path);
      take(state);
      return state;
    });
  } catch (error) { complain(error, path); return null; }
};
// Bypasses the queue, to end a search at once.
app.postNow = post;
app.stopSolving = async () => { try { take(await post('api/stop')); } catch (error) { complain(error); } };
// Undo or redo during playback does not store the stopped position: a new step would clear the redo list.
app.step = async (path) => {
  const played = app.player.playing;
  app.player.halt();
  await app.ask(path);
  if (played) await app.view.rest();
};

// ------------------------------------------------------------------------------------------------------------- ghosts
app.choose = (name, walking = false) => {
  app.ghost = name;
  app.ghostTarget = null;
  if (!walking && !name) { app.view.stack = []; app.view.spot = null; }
  app.view.refreshOutline();
  drawSection();
  app.refreshPanel();
  app.hint();
};
app.chooseGhostTarget = (number) => {
  Object.assign(app, { ghostTarget: number, ghost: null });
  app.view.outline = null;
  app.view.forget();
  drawSection();
  app.refreshPanel();
  app.hint();
  app.view.redraw();
};
app.chooseLight = (k) => { if (app.light !== k) { app.light = k; app.refreshPanel(); } };
function writeLights(lights) {
  // a light that was added after this picture was requested has no place in it
  if (app.tab === 'light' && lights[app.light]) panels.light.moved?.(lights[app.light]);
}
// writing numbers costs a layout of the panel: ten times a second is enough
let wrote = 0;
app.lightsMoved = (lights) => {
  const now = performance.now();
  if (app.tab !== 'light' || now - wrote < 90) return;
  wrote = now;
  writeLights(lights);
};
app.hint = () => {
  const { stack, at } = app.view;
  const place = stack.length > 1 && stack[at] === app.ghost ? ` – ${at + 1} of ${stack.length} here, scroll to step through them` : '';
  $('hint').textContent = app.ghost ? `Ghost ${app.ghost}${place}` : '';
};
app.places = latest(async () => {
  if (app.tab !== 'target' || app.state?.lens.measured) return;
  try { app.view.places = (await get('api/places')).places; app.view.unplaced = ''; } catch (error) { app.view.places = []; app.view.unplaced = inWords(error); }
  panels.target.update?.(app.state);
  app.view.redraw();
});
const loadGhosts = latest(async () => {
  app.ghosts = await get('api/ghosts');
  plainGhosts = structuredClone(app.ghosts);
  if (!app.state) return;
  app.refreshPanel();
  if (app.ghost) app.view.refreshOutline();
});

// ------------------------------------------------------------------------------------------------------ cross-section
let shut = localStorage.getItem('section') === 'shut';
const drawing = h('div', { class: 'drawing' });
const reported = h('span');
const fold = button('', () => { shut = !shut; localStorage.setItem('section', shut ? 'shut' : 'open'); folded(); drawSection(); }, { kind: 'quiet', tip: 'Show or hide the cross-section (X).' });
function folded() { const none = Boolean(app.state?.lens.measured); $('section').classList.toggle('shut', shut || none); fold.hidden = none; fold.textContent = shut ? 'show section' : 'hide'; app.view.redraw(); }
const drawSection = latest(async () => {
  if (!app.state) return;
  folded();
  if (shut || app.state.lens.measured) { reported.replaceChildren(...facts(app.state)); return; }
  const { ghost } = app;
  const answer = await fetch(`api/section${ghost ? `?ghost=${encodeURIComponent(ghost)}` : ''}`);
  // for a lens without an image keep the previous drawing
  if (!answer.ok) { reported.replaceChildren(...facts(app.state)); return; }
  const found = await answer.json();
  drawing.innerHTML = found.svg;
  if (found.svg) fitted(drawing.firstElementChild, drawing.clientWidth - 20, drawing.clientHeight - 4);
  reported.replaceChildren(...facts(app.state), ...(ghost ? [h('span', {}, found.reported ? 'ghost ' : 'rays of ghost ', h('b', {}, ghost), found.reported ? `: ${found.reported}` : '')] : []));
});
function facts(state) {
  const { facts: f, name } = state.lens;
  const say = (label, value, digits, unit = '') => (value === undefined ? [] : [h('span', {}, `${label} `, h('b', {}, `${Number(value.toPrecision(digits))}${unit}`))]);
  return [h('b', { title: name }, name), ...say('focal length', f.efl, 5, ' mm'), ...say('f/', f.f_number, 3), ...say('back focus', f.bfl, 5, ' mm')];
}

// ------------------------------------------------------------------------------------------------------------- header
function header() {
  const file = h('span', { class: 'file' });
  const undo = button('↶', () => app.step('api/undo'), { kind: 'quiet', 'aria-label': 'Undo', id: 'undo' });
  const redo = button('↷', () => app.step('api/redo'), { kind: 'quiet', 'aria-label': 'Redo', id: 'redo' });
  const look = h('select', { id: 'look', 'aria-label': 'View', tip: 'Conversion of linear light to a picture for the screen; files stay linear.' },
    h('option', { value: 'filmic' }, 'Filmic'), h('option', { value: 'srgb' }, 'sRGB'), h('option', { value: 'aces' }, 'ACES'), h('option', { value: 'false-colour' }, 'False colour'));
  look.addEventListener('change', () => app.setView({ look: look.value }));
  const exposure = slider({
    label: 'Exposure', tip: 'In stops: each stop doubles the light. Changes the screen only, no file.', min: -6, max: 30, step: 0.1, digits: 1, name: 'exposure',
    get: stopsOf, set: (value) => expose(value),
  });
  const auto = button('Auto', autoExpose, { tip: 'Set the exposure so that ghosts are visible (A). It is constant while the light moves, so brightness can be compared.' });
  const exposed = exposure.element;
  exposed.className = 'exposure';
  $('bar').append(
    h('span', { class: 'brand' }, 'Flarewright'),
    button('Open', openFile, { tip: 'Open a project, a lens file, a measured flare, a photograph, or a lens by name (O).', id: 'open' }),
    button('Save', () => save(), { tip: 'Save the project file (Ctrl+S).', id: 'save' }),
    button('Export ▾', (event) => menu(event.currentTarget, exports), { id: 'export', tip: 'The project under another name, pictures, lens, table of ghosts, or the command that renders the saved project.' }),
    file, h('span', { class: 'split' }), undo, redo, h('span', { class: 'gap' }), exposed, auto, look,
    button('?', help, { kind: 'quiet', tip: 'All shortcuts (?).', 'aria-label': 'Help', id: 'help' }),
  );
  return {
    update(state) {
      file.textContent = `${fileName(state)}${state.clean ? '' : ' •'}`;
      file.title = state.file ?? 'not saved as a file yet; kept in the autosave';
      undo.disabled = !state.undo; redo.disabled = !state.redo;
      undo.dataset.tip = state.undo ? `Undo: ${state.undo} (Ctrl+Z)` : 'Nothing to undo.';
      redo.dataset.tip = state.redo ? `Redo: ${state.redo} (Ctrl+Shift+Z)` : 'Nothing to redo.';
      look.value = state.view.look;
      look.children[2].disabled = !state.aces;
      look.children[2].textContent = state.aces ? 'ACES' : 'ACES (pip install opencolorio)';
      exposure.update(state);
      press(auto, state.plate?.lit ? state.view.plate_stops === 0 : state.view.exposure_stops === null);
    },
  };
}
const exports = [
  ['Save as…', saveAs, 'Save the project under another name, which becomes its file (Ctrl+Shift+S).'],
  ['EXR with layers', () => download('exr'), 'Rendered at the size and quality of the project; takes as long as a render. Values are irradiances times its attribute flarewright.scale.'],
  ['Comp as EXR', () => download('comp'), 'The plate with its flare, in the values of the plate; for lights that were found in it.'],
  ['PNG as shown', () => download('png')],
  ['Lens file', () => download('lens')],
  ['Project file', () => download('project')],
  ['Look', () => download('look'), 'Coatings, iris, dirt and colours of this project, for other lenses and lights.'],
  ['Ghosts as CSV', () => download('csv')],
  ['Copy as command line', copyCommand],
];
async function download(kind) {
  if (['exr', 'comp'].includes(kind)) toast('Rendering the EXR…');
  try {
    // wait for pending changes, to export what the page shows
    await line(() => {});
    const answer = await fetch(`api/export/${kind}`);
    if (!answer.ok) throw new Error((await answer.json()).error);
    const name = /filename="([^"]+)"/.exec(answer.headers.get('Content-Disposition'))?.[1] ?? `flare.${kind}`;
    const link = h('a', { href: URL.createObjectURL(await answer.blob()), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    toast(`Exported ${name}`, 'good');
  } catch (error) { complain(error); }
  working('', 1);
}
async function copyCommand() {
  try {
    const { text } = await line(() => get('api/command'));
    try {
      await navigator.clipboard.writeText(text);
      toast(`Copied: ${text}`, 'good', 9000);
    } catch {
      // browsers block the clipboard on pages of other computers
      const box = h('textarea', { readonly: true, rows: 3, name: 'command', 'aria-label': 'Command line' }, text);
      dialog('Command line', h('p', { class: 'quietly' }, 'It renders the saved project. Copy it with Ctrl+C.'), box);
      box.select();
    }
  } catch (error) { complain(error); }
}
// A dialog for a file name; an error appears in it, so that the name can be corrected.
function asking(title, words, value, path, done = () => {}) {
  const box = h('input', { type: 'text', value, style: 'width:420px', name: 'path', 'aria-label': words, spellcheck: 'false' });
  const wrong = h('p', { class: 'wrong', role: 'alert' });
  const form = h('form', {}, h('p', { class: 'quietly' }, words), box, wrong, h('div', { class: 'buttons', style: 'justify-content:end;margin-top:10px' },
    button('Cancel', () => window_.close()), h('button', { class: 'main', type: 'submit' }, title)));
  const window_ = dialog(title, form);
  let busy = false;
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    if (busy || !box.value.trim()) return;
    busy = true;
    try {
      const state = await line(() => post(path, { text: box.value.trim() }));
      take(state);
      window_.close();
      done(state);
    } catch (error) { wrong.textContent = inWords(error); }
    busy = false;
  });
  box.focus(); box.select();
}
const saved = (state) => toast(state.reported, 'good', 4500, 'api/save');
function openFile() { asking('Open', 'A project file, a lens file, a measured flare, a photograph, or a lens’ name. Files can also be dropped on the page.', '', 'api/open'); }
function saveAs() { asking('Save', 'Path of the project file, like shot.toml.', app.state.file ?? 'flare.toml', 'api/save', saved); }
async function save() {
  const text = app.state.file;
  if (!text) { saveAs(); return; }
  const state = await app.ask('api/save', { text });
  if (state) saved(state);
}

// ------------------------------------------------------------------------------------------------------------- status
const grade = h('span', { id: 'grade' });
const what = h('span');
const bar = h('i');
const meter = h('span', { class: 'bar', hidden: true }, bar);
const remark = h('span', { class: 'remark' });
const size = h('span');
function working(words, part) {
  meter.hidden = part >= 1 || !words;
  what.textContent = meter.hidden ? '' : words;
  bar.style.width = `${100 * part}%`;
}
app.status = status;
const GRADES = { moving: 'moving, by matrices', draft: 'draft, by matrices', soon: 'final for the screen, by traced rays', final: 'final, by traced rays', working: 'working view, by matrices' };
const MEASURED = { moving: 'moving, its ghosts and glow', draft: 'its ghosts and glow', soon: 'its ghosts and glow', final: 'measured, with the residual of its photographs' };
const FIRST = 'drawing the first picture; the very first on a computer takes some ten seconds';
function gradeWords({ grade: drawn, seconds, number, current, problem }) {
  const { mover, shownGrade, shownNumber } = app.view;
  const named = app.state.lens.measured ? MEASURED : GRADES;
  if (!drawn) return problem ? 'no picture yet' : FIRST;
  if (problem) return 'the last good picture';
  // during a drag the shown picture belongs to no project state
  if (!mover.live && !current) return shownGrade === 'moving' ? named.moving : 'the previous picture, until the new one is drawn';
  const words = named[shownGrade] ?? named[drawn];
  if (shownNumber !== number || !seconds) return words;
  return `${words} · ${seconds < 1 ? `${Math.round(seconds * 1000)} ms` : `${seconds.toFixed(1)} s`}`;
}
function status() {
  if (!app.state) return;
  const { picture, frame, camera } = app.state;
  const words = gradeWords(picture);
  // called for each picture of a drag
  if (grade.textContent !== words) grade.textContent = words;
  size.textContent = `${camera.size_px.join(' × ')} px · ${frame.sensor.map((mm) => Number(mm.toFixed(2))).join(' × ')} mm`;
  remark.textContent = picture.remarks.join(' · ');
  remark.title = picture.remarks.join('\n');
}

// --------------------------------------------------------------------------------------------------------------- tabs
const panels = {
  light: lightPanel(app), ghosts: ghostPanel(app), lens: panelOfLens(lensPanel(app)), iris: panelOfLens(irisPanel(app)),
  coating: panelOfLens(coatingPanel(app)), target: panelOfLens(targetPanel(app)), library: libraryPanel(app),
};
const NAMES = { light: 'Light', ghosts: 'Ghosts', lens: 'Lens', iris: 'Iris', coating: 'Coating', target: 'Target', library: 'Library' };
app.panels = panels;
// scroll position of each panel
const scrolled = {};
app.open = (tab) => {
  scrolled[app.tab] = $('page').scrollTop;
  app.tab = tab;
  for (const each of $('tabs').children) { each.setAttribute('aria-selected', each.dataset.tab === tab); each.tabIndex = each.dataset.tab === tab ? 0 : -1; }
  $('page').replaceChildren(panels[tab].element);
  $('page').setAttribute('aria-labelledby', `tab-${tab}`);
  app.view.annotate = tab === 'target';
  if (tab !== 'target') app.view.compare = 'physical';
  panels[tab].shown?.();
  panels.light.open(tab === 'light');
  if (app.state) { app.refreshPanel(); app.places(); }
  $('page').scrollTop = scrolled[tab] ?? 0;
  app.view.redraw();
};
function tabs() {
  Object.entries(NAMES).forEach(([key, name], k) => $('tabs').append(
    h('button', { role: 'tab', type: 'button', id: `tab-${key}`, 'aria-controls': 'page', 'data-tab': key, onclick: () => app.open(key), tip: `Key ${k + 1}` }, name)));
  $('tabs').addEventListener('keydown', (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const keys = Object.keys(NAMES);
    app.open(keys[(keys.indexOf(app.tab) + step + keys.length) % keys.length]);
    document.querySelector('[role=tab][aria-selected=true]').focus();
  });
}

// ---------------------------------------------------------------------------------------------------------- shortcuts
const KEYS = [
  ['Drag', 'move the light, also out of the frame'], ['Click', 'choose the ghost under the pointer'],
  ['Scroll on it', 'step through the ghosts there'], ['Scroll', 'zoom, also PgUp and PgDn'], ['Alt + drag', 'pan, also the middle button and Ctrl + arrows'],
  ['Arrows', 'move the light by 0.1°, Shift 1°'], ['Delete', 'remove the chosen light'], ['F', 'fit the frame'], ['Z', 'zoom to 1:1'], ['A', 'automatic exposure'], ['+  −', 'exposure by half a stop'],
  ['V', 'next view'], ['G', 'grey: equal reflectances'], ['E', 'no entrance clipping'], ['H', 'safe frame'],
  ['S', 'solo the chosen ghost'], ['M', 'mute the chosen ghost'], ['N  P', 'next, previous ghost of the list'],
  ['T', 'play the light’s path, stop'], ['K', 'key the light at this time'], [', .', 'previous, next key'],
  ['X', 'show or hide the cross-section'], ['1 – 7', 'panels'], ['W', 'physical, target, wipe, side by side'], ['[  ]', 'move the wipe'], ['Ctrl+Z', 'undo'],
  ['Ctrl+Shift+Z', 'redo'], ['Ctrl+S', 'save'], ['Ctrl+Shift+S', 'save under another name'], ['O', 'open'], ['Esc', 'deselect the ghost'], ['?', 'this list'],
];
function help() { dialog('Keys and mouse', h('div', { class: 'keys' }, ...KEYS.flatMap(([key, words]) => [h('kbd', {}, key), h('span', {}, words)]))); }
let nudging = null;
// keys repeat faster than answers: continue from the last requested place
const ahead = { asked: 0, light: null, place: null };
function nudge(dx, dy, big) {
  const light = app.state.lights[app.light];
  nudging ??= stroke();
  app.player.halt();
  const [x, y] = ahead.asked && ahead.light === app.light ? ahead.place : light.field_deg;
  const by = big ? 1 : 0.1;
  light.field_deg = [x + dx * by, y + dy * by];
  Object.assign(ahead, { asked: ahead.asked + 1, light: app.light, place: light.field_deg });
  app.lively('move_light', { light: app.light, x: light.field_deg[0], y: light.field_deg[1] }, nudging).finally(() => { ahead.asked -= 1; });
}
// Only where the keys work on the picture, or where a light was just chosen: in another list, Delete has another meaning.
const removeLight = () => { if ((document.activeElement === $('view') || document.activeElement.closest('.lamps')) && app.state.lights.length > 1) app.command('remove_light', { light: app.light }).catch(() => {}); };
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const PAN_PX = 40;
addEventListener('keyup', (event) => { if (event.key.startsWith('Arrow')) nudging = null; if (event.key === ' ') app.view.space = false; });
addEventListener('keydown', (event) => {
  if (!app.state || document.querySelector('dialog[open]')) return;
  const onPage = event.target === $('view') || event.target === document.body;
  const typing = event.target.matches('input:not([type=range]):not([type=checkbox]), select, textarea');
  if (event.ctrlKey || event.metaKey) {
    const key = event.key.toLowerCase();
    if (key === 's') { event.preventDefault(); document.activeElement.blur(); if (event.shiftKey) saveAs(); else save(); }
    if (typing) return;
    if (key === 'z') { event.preventDefault(); app.step(event.shiftKey ? 'api/redo' : 'api/undo'); }
    if (key === 'y') { event.preventDefault(); app.step('api/redo'); }
    if (ARROWS[event.key] && onPage) { event.preventDefault(); const [x, y] = ARROWS[event.key]; app.view.pan(-PAN_PX * x, PAN_PX * y); }
    return;
  }
  if (typing || event.altKey) return;
  const { view } = app.state;
  const steps = ARROWS[event.key];
  if (steps && onPage) { event.preventDefault(); nudge(...steps, event.shiftKey); return; }
  const zoom = { PageUp: 1.25, PageDown: 0.8 }[event.key];
  if (zoom && onPage) { event.preventDefault(); app.view.zoomBy(zoom); return; }
  if (event.key === ' ' && onPage) { event.preventDefault(); app.view.space = true; return; }
  const looks = ['filmic', 'srgb', ...(app.state.aces ? ['aces'] : []), 'false-colour'];
  const work = {
    f: () => app.view.fit(), z: () => app.view.fit(app.state.frame.full[0] / app.view.frame().w * app.view.zoom / (devicePixelRatio || 1)), a: autoExpose,
    '+': () => expose(stopsOf(app.state) + 0.5), '=': () => expose(stopsOf(app.state) + 0.5), '-': () => expose(stopsOf(app.state) - 0.5),
    v: () => app.setView({ look: looks[(looks.indexOf(view.look) + 1) % looks.length] }), g: () => app.setView({ grey: !view.grey }),
    e: () => app.setView({ unclipped: !view.unclipped }), h: () => app.setView({ safe_frame: !view.safe_frame }),
    Delete: removeLight, Backspace: removeLight, s: () => panels.ghosts.solo(), m: () => panels.ghosts.mute(), n: () => panels.ghosts.step(1), p: () => panels.ghosts.step(-1),
    t: () => app.player.toggle(), k: () => app.player.key(), ',': () => app.player.step(-1), '.': () => app.player.step(1),
    '[': () => app.view.moveWipe(-0.05), ']': () => app.view.moveWipe(0.05), x: () => fold.click(), w: () => { app.open('target'); panels.target.next(); }, o: openFile, '?': help, Escape: () => app.choose(null),
  }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (work) { event.preventDefault(); work(); return; }
  const tab = Object.keys(NAMES)[Number(event.key) - 1];
  if (tab && !event.shiftKey) app.open(tab);
});

// ---------------------------------------------------------------------------------------------------------- dropping
export async function importFile(file, as = '', light = null) {
  const answer = await app.ask(`api/import?name=${encodeURIComponent(file.name)}${as ? `&as=${as}` : ''}${light === null ? '' : `&light=${light}`}`, file);
  if (!answer) return;
  // remarks on the previous file are outdated
  forget('noticed');
  toast(`Opened ${file.name}`, 'good', 4500, 'opened');
  // a toast, as a dialog would interrupt the user
  if (answer.reported?.length) toast(h('ul', { class: 'remarks' }, ...answer.reported.map((words) => h('li', {}, sentence(words)))), 'info', 20000, 'noticed');
}
app.importFile = importFile;
let over = 0;
// accept files only, not dragged text
const carriesFiles = (event) => [...event.dataTransfer?.types ?? []].includes('Files');
addEventListener('dragstart', (event) => event.preventDefault());
addEventListener('dragenter', (event) => { event.preventDefault(); if (!carriesFiles(event)) return; over += 1; $('drop').hidden = false; });
addEventListener('dragleave', () => { over -= 1; if (over <= 0) $('drop').hidden = true; });
addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', async (event) => {
  event.preventDefault();
  over = 0;
  $('drop').hidden = true;
  for (const file of event.dataTransfer.files) await importFile(file);
});

// ---------------------------------------------------------------------------------------------------------- listening
function listen() {
  const socket = new WebSocket(socketAddress('ws'));
  app.tell = (words) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(words)); };
  socket.onopen = () => { if (app.view.room) app.tell({ room: app.view.room }); hush('lost'); if (listen.lost) { toast('The editor is back.', 'good'); listen.lost = false; app.state = null; app.view.shownNumber = -1; } reload(); loadGhosts(); };
  socket.onmessage = (message) => hear(JSON.parse(message.data));
  socket.onclose = () => {
    if (!listen.lost) toast(LOST, 'error', Infinity, 'lost');
    listen.lost = true;
    setTimeout(listen, 1000);
  };
}
function hear(event) {
  const { state } = app;
  if (event.type === 'changed') { if (!state || event.revision > state.revision) reload(); return; }
  if (event.type === 'message') { toast(event.text, event.kind === 'warning' ? 'error' : 'info'); return; }
  if (event.type === 'progress') { working(event.what, event.part); return; }
  if (event.type === 'export') { working('EXR', event.part); return; }
  if (event.type === 'ghosts') { working('', 1); loadGhosts(); return; }
  // it may be newer than the first state, which is on its way
  if (!state) { reload(); return; }
  // the brightness of the target's ghosts follows the last final picture
  if (event.type === 'matched') app.view.refreshTarget();
  if (event.type === 'picture') {
    state.picture = event;
    state.view.stops = event.stops;
    plain.view.stops = event.stops;
    working('', 1);
    if (event.number !== app.view.shownNumber) app.view.refresh(true);
    update();
    if (event.grade === 'working') app.view.refreshTarget();
  }
  if (event.type === 'finding') {
    state.finding = event;
    panels.light.update(state);
    app.view.redraw();
    return;
  }
  if (event.type === 'solve') { state.solve = event; panels.target.update?.(state); }
}

app.view = viewport($('view'), app);
const parts = [header()];
$('section').append(h('div', { class: 'head' }, reported, h('span', { class: 'gap' }), fold), drawing);
$('status').append(grade, meter, what, h('span', { class: 'gap' }), remark, size);
tabs();
folded();
app.open('light');
tips();
listen();
