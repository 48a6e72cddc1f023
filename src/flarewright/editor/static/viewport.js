// The viewport: dragging lights and ghosts, picking, zoom. All pixels come from the server; this file places them.
import { complain, get, latest, post } from './api.js';
import { mover } from './mover.js';
import { stroke } from './ui.js';

const FADE_MS = 160;
const NEAR_PX = 16;
const CLICK_PX = 4;
// more lights have small handles
const MANY = 4;
const STEEPEST = 80;
const DISTORTION_STEP = 2;
const STEPS = [0, -21, 21, -42, 42];
const INK = 'rgba(240,176,84,.95)';
const TARGET = 'target, by matrices';
// pause between two target pictures of a drag: this multiple of the time of one, within bounds
const FOLLOW_MS = 160;
const FOLLOW_PART = 6;
const FOLLOW_MOST_MS = 400;
// wait for the end of resizing and zooming
const ROOM_MS = 250;

export function viewport(canvas, app) {
  const hint = document.getElementById('hint');
  const pen = canvas.getContext('2d', { alpha: false });
  const self = {
    image: null, before: null, fadeFrom: 0, target: null, outline: null, hover: null, compare: 'physical', wipe: 0.5,
    zoom: 1, panX: 0, panY: 0, drag: null, stack: [], at: 0, spot: null, asked: null, annotate: false, places: [], unplaced: '', preview: null,
  };
  let wanted = false;
  // areas of labels in the present frame
  let taken = null;
  let telling = 0;

  // ------------------------------------------------------------------------------------------------------ geometry
  const box = () => ({ w: canvas.clientWidth, h: canvas.clientHeight });
  const doubled = () => self.compare === 'side';
  // width of the physical picture's part of the page
  const half = () => (doubled() ? box().w / 2 : box().w);
  function frame() {
    const [width, height] = app.state.frame.size;
    const { w, h } = box();
    const room = half();
    const fit = Math.min((room - 28) / width, (h - 28) / height) * self.zoom;
    const fw = width * fit;
    const fh = height * fit;
    return { x: room / 2 - fw / 2 + self.panX, y: h / 2 - fh / 2 + self.panY, w: fw, h: fh, mm: fw / app.state.frame.sensor[0], shift: w / 2 };
  }
  // a lens without an image keeps the last focal length, and so its handles
  const efl = () => { self.efl = app.state.lens.facts.efl || self.efl || 50; return self.efl; };
  // from millimetres in the upright picture to pixels of the page, and back
  const toPage = (x, y, f = frame()) => [f.x + f.w / 2 + x * f.mm, f.y + f.h / 2 - y * f.mm * stretch(f)];
  const stretch = (f) => (f.h / app.state.frame.sensor[1]) / f.mm;
  const toMm = (px, py, f = frame()) => [(px - f.x - f.w / 2) / f.mm, -(py - f.y - f.h / 2) / (f.mm * stretch(f))];
  // Image place of a light: its chief ray with the lens' distortion; for near lights the paraxial place.
  const distortion = (slope, light) => {
    const known = light.distance ? [] : app.state.lens.distortion ?? [];
    if (!known.length) return 1;
    const at = Math.min(Math.atan(slope) * 180 / Math.PI / DISTORTION_STEP, known.length);
    const k = Math.min(Math.floor(at), known.length - 1);
    const before = k ? known[k - 1] : 1;
    return before + (at - k) * (known[k] - before);
  };
  // place of the optical axis in the picture; for a measured flare it may be off the middle
  const axis = () => app.state.lens.axis_mm ?? [0, 0];
  // The page's place of a light of a lens that is not round is paraxial; on a plate the server traces it, and the
  // difference stays during a drag.
  const missed = (light) => {
    if (!light.placed) return [0, 0];
    const known = app.state.lights.find((one) => one.name === light.name) ?? light;
    const [across, down] = app.state.frame.sensor;
    const paraxial = plainPlace({ ...light, field_deg: known.field_deg });
    return [(light.placed[0] - 0.5) * across - paraxial[0], (0.5 - light.placed[1]) * down - paraxial[1]];
  };
  const place = (light) => { const off = missed(light); return plainPlace(light).map((mm, k) => mm + off[k]); };
  const plainPlace = (light) => {
    const slopes = light.field_deg.map((deg) => Math.tan(deg * Math.PI / 180));
    const part = efl() * distortion(Math.hypot(...slopes), light);
    return slopes.map((slope, k) => axis()[k] + part * slope);
  };
  function anglesAt(at, light) {
    const off = missed(light);
    const mm = at.map((each, k) => each - axis()[k] - off[k]);
    const reach = Math.hypot(...mm) / efl();
    let [near, far] = [0, Math.tan(STEEPEST * Math.PI / 180)];
    for (let k = 0; k < 40; k++) {
      const middle = (near + far) / 2;
      if (middle * distortion(middle, light) < reach) near = middle; else far = middle;
    }
    return mm.map((each) => (reach ? Math.atan(each / efl() * far / reach) * 180 / Math.PI : 0));
  }
  const lightAt = (k) => (self.mover.live && self.mover.lights?.[k]) || app.state.lights[k].field_deg;
  const placeOf = (k, field) => place({ ...app.state.lights[k], field_deg: field });
  const lightPage = (k) => toPage(...place({ ...app.state.lights[k], field_deg: lightAt(k) }));
  // keep a handle outside the view at the border, so that it can be dragged
  function handle(k) {
    const [x, y] = lightPage(k);
    const { h } = box();
    const room = half();
    const cx = Math.max(12, Math.min(room - 12, x));
    const cy = Math.max(12, Math.min(h - 12, y));
    return [cx, cy, cx !== x || cy !== y];
  }

  // ------------------------------------------------------------------------------------------------------- drawing
  function redraw() {
    if (wanted) return;
    wanted = true;
    requestAnimationFrame(draw);
  }
  function draw(now) {
    wanted = false;
    taken = null;
    const { w, h } = box();
    const ratio = devicePixelRatio || 1;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio);
      canvas.height = Math.round(h * ratio);
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = '#121212';
    pen.fillRect(0, 0, w, h);
    if (!app.state) return;
    const f = frame();
    if (self.spot && self.spotFrame !== JSON.stringify(f)) self.forget();
    pen.imageSmoothingEnabled = self.zoom < 3;
    pen.imageSmoothingQuality = self.mover.live ? 'low' : 'high';
    if (doubled()) within(f.shift, w, () => { pen.translate(f.shift, 0); wantedPicture(f, 0); border(f); label(TARGET, f.x + 8, f.y + 16, 'left'); });
    within(0, half(), () => {
      picture(f, now);
      border(f);
      if (app.state.view.safe_frame) safe(f);
      outlines(f);
      overlays(f);
      paths(f);
      lights();
    });
    if (app.state.view.look === 'false-colour') legend(w);
    tellRoom(f, ratio);
    if (self.measure) { self.measure(now); }
  }
  // Report the frame's size in screen pixels, the size of pictures at rest.
  function tellRoom(f, ratio) {
    const room = [f.w, f.h].map((side) => Math.round(side * ratio));
    if (String(room) === String(self.room)) return;
    self.room = room;
    clearTimeout(telling);
    telling = setTimeout(() => app.tell({ room: self.room }), ROOM_MS);
  }
  // Clip drawing to one half.
  function within(from, to, paint) {
    pen.save();
    pen.beginPath();
    pen.rect(from, 0, to - from, box().h);
    pen.clip();
    paint();
    pen.restore();
  }
  function wantedPicture(f, from) {
    if (!self.target) return;
    pen.save();
    pen.beginPath();
    pen.rect(f.x + from, f.y, f.w - from, f.h);
    pen.clip();
    pen.drawImage(self.target, f.x, f.y, f.w, f.h);
    pen.restore();
  }
  function picture(f, now) {
    const part = Math.min(1, (now - self.fadeFrom) / FADE_MS);
    if (self.before && part < 1) {
      pen.drawImage(self.before, f.x, f.y, f.w, f.h);
      pen.globalAlpha = part;
    }
    if (self.image) pen.drawImage(self.image, f.x, f.y, f.w, f.h);
    pen.globalAlpha = 1;
    if (part < 1) redraw(); else self.before = null;
    if (self.compare === 'physical' || !self.target) return;
    if (self.compare !== 'side') wantedPicture(f, self.compare === 'wipe' ? f.w * self.wipe : 0);
    if (self.compare === 'wipe') {
      pen.fillStyle = INK;
      pen.fillRect(f.x + f.w * self.wipe - 0.5, f.y, 1, f.h);
      pen.beginPath();
      pen.arc(f.x + f.w * self.wipe, f.y + f.h - 18, 7, 0, 7);
      pen.fill();
      label('physical', f.x + f.w * self.wipe - 10, f.y + f.h - 14, 'right');
      label(TARGET, f.x + f.w * self.wipe + 10, f.y + f.h - 14, 'left');
    }
    if (self.compare === 'side') label('physical', f.x + 8, f.y + 16, 'left');
    if (self.compare === 'target') label(TARGET, f.x + 8, f.y + 16, 'left');
  }
  // Draw a label, moved up or down if it would overlap other text.
  function label(text, x, y, align) {
    pen.font = '11px system-ui, sans-serif';
    pen.textAlign = align;
    taken ??= [{ left: hint.offsetLeft, right: hint.offsetLeft + hint.offsetWidth, top: hint.offsetTop, bottom: hint.offsetTop + hint.offsetHeight }];
    const wide = pen.measureText(text).width;
    const left = x + pen.getTransform().e / (devicePixelRatio || 1) - { left: 0, center: 0.5, right: 1 }[align] * wide;
    const free = (low) => !taken.some((each) => left < each.right && each.left < left + wide && low - 10 < each.bottom && each.top < low + 3);
    const low = STEPS.map((step) => y + step).find(free) ?? y;
    taken.push({ left, right: left + wide, top: low - 10, bottom: low + 3 });
    pen.fillStyle = '#000a';
    pen.fillText(text, x + 1, low + 1);
    pen.fillStyle = '#ddd';
    pen.fillText(text, x, low);
  }
  // legend of the false colours: stops from middle grey at their limits
  function legend(w) {
    const all = app.state.false_colours;
    const wide = 30;
    const left = w - 14 - all.length * wide;
    pen.font = '10px system-ui, sans-serif';
    pen.textAlign = 'center';
    pen.fillStyle = '#000a';
    pen.fillRect(left - 10, 8, all.length * wide + 20, 40);
    all.forEach(([stops, colour], k) => {
      pen.fillStyle = colour;
      pen.fillRect(left + k * wide, 12, wide, 8);
      pen.fillStyle = '#ddd';
      if (k + 1 < all.length) pen.fillText(stops > 0 ? `+${stops}` : `${stops}`.replace('-', '−'), left + (k + 1) * wide, 31);
    });
    pen.fillText('stops from middle grey', left + all.length * wide / 2, 43);
  }
  function border(f) {
    pen.strokeStyle = '#3c3c3c';
    pen.lineWidth = 1;
    pen.strokeRect(Math.round(f.x) - 0.5, Math.round(f.y) - 0.5, Math.round(f.w) + 1, Math.round(f.h) + 1);
  }
  function safe(f) {
    pen.strokeStyle = 'rgba(220,220,220,.35)';
    for (const part of [0.9, 0.8]) pen.strokeRect(f.x + f.w * (1 - part) / 2, f.y + f.h * (1 - part) / 2, f.w * part, f.h * part);
    pen.beginPath();
    const [cx, cy] = [f.x + f.w / 2, f.y + f.h / 2];
    pen.moveTo(cx - 9, cy); pen.lineTo(cx + 9, cy); pen.moveTo(cx, cy - 9); pen.lineTo(cx, cy + 9);
    pen.stroke();
  }
  function overlays(f) {
    if (!self.mover.live) {
      if (self.hover) { pen.globalAlpha = 0.55; pen.drawImage(self.hover, f.x, f.y, f.w, f.h); pen.globalAlpha = 1; }
      // the outline belongs to the physical picture
      const part = self.compare === 'wipe' ? self.wipe : self.compare === 'target' ? 0 : 1;
      if (self.outline && part > 0) pen.drawImage(self.outline, 0, 0, self.outline.width * part, self.outline.height, f.x, f.y, f.w * part, f.h);
    }
    if (!self.annotate) return;
    const [ax, ay] = toPage(...line(-400));
    const [bx, by] = toPage(...line(400));
    pen.strokeStyle = 'rgba(240,176,84,.28)';
    pen.setLineDash([5, 5]);
    pen.beginPath(); pen.moveTo(ax, ay); pen.lineTo(bx, by); pen.stroke();
    pen.setLineDash([]);
    for (const one of targetCircles()) {
      const chosen = one.key === self.chosenKey();
      if (!chosen && !one.changed) continue;
      const [x, y] = toPage(...line(one.place));
      pen.strokeStyle = chosen ? INK : 'rgba(240,176,84,.5)';
      pen.lineWidth = chosen ? 1.6 : 1;
      pen.setLineDash(one.removed ? [3, 4] : []);
      pen.beginPath(); pen.arc(x, y, Math.max(3, Math.abs(one.radius) * f.mm), 0, 7); pen.stroke();
      pen.setLineDash([]);
      if (chosen) { pen.fillStyle = INK; pen.beginPath(); pen.arc(x, y, 3, 0, 7); pen.fill(); }
      if (one.removed) label('removed', x, y - 6, 'center');
    }
    pen.lineWidth = 1;
  }
  // what a search would find in the plate, whose centre fills the frame
  function outlines(f) {
    const plate = self.mover.live ? null : app.plateLights?.();
    if (!plate) return;
    const [wide, high] = plate.size;
    const zoom = Math.max(f.w / wide, f.h / high);
    pen.lineWidth = 1.3;
    for (const one of plate.lights) {
      const x = f.x + f.w / 2 + (one.x - wide / 2) * zoom;
      const y = f.y + f.h / 2 + (one.y - high / 2) * zoom;
      const [a, b] = [one.width, one.height].map((side) => Math.max(side * zoom / 2 + 2.5, 5));
      pen.setLineDash(one.kind === 'joined' ? [3, 3] : []);
      for (const [ink, thick] of [['#000a', 3], ['#5fe07d', 1.3]]) {
        pen.strokeStyle = ink;
        pen.lineWidth = thick;
        pen.beginPath();
        if (one.kind === 'rectangle') {
          pen.save();
          pen.translate(x, y);
          pen.rotate(-one.rotation_deg * Math.PI / 180);
          pen.rect(-a, -b, 2 * a, 2 * b);
          pen.restore();
        } else pen.ellipse(x, y, a, b, -one.rotation_deg * Math.PI / 180, 0, 7);
        pen.stroke();
      }
    }
    pen.setLineDash([]);
    pen.lineWidth = 1;
  }
  // the path of a keyed light: straight in field angles, so slightly curved in the picture
  function paths(f) {
    pen.strokeStyle = 'rgba(240,176,84,.45)';
    pen.fillStyle = INK;
    app.state.lights.forEach((light, k) => {
      if (light.keys.length < 1) return;
      pen.globalAlpha = k === app.light ? 1 : 0.4;
      const at = (deg) => toPage(...place({ ...light, field_deg: deg }), f);
      pen.beginPath();
      light.keys.forEach((key, n) => {
        const before = light.keys[n - 1]?.field_deg ?? key.field_deg;
        for (let step = n ? 1 : 12; step <= 12; step++) pen.lineTo(...at(before.map((deg, axis) => deg + (key.field_deg[axis] - deg) * step / 12)));
      });
      pen.stroke();
      for (const key of light.keys) { const [x, y] = at(key.field_deg); pen.fillRect(x - 2.5, y - 2.5, 5, 5); }
    });
    pen.globalAlpha = 1;
  }
  function lights() {
    app.state.lights.forEach((light, k) => {
      const [x, y, held] = handle(k);
      const chosen = k === app.light;
      pen.strokeStyle = '#000a'; pen.lineWidth = 3;
      if (!chosen && app.state.lights.length > MANY) {
        // small rings, which leave the lamps of a city visible
        for (const [ink, thick] of [['#000a', 3], ['#ddd', 1]]) {
          pen.strokeStyle = ink; pen.lineWidth = thick;
          // there is no lamp at the centroid of joined ones
          if (!light.starburst) pen.setLineDash([2, 2]);
          pen.beginPath(); pen.arc(x, y, 4, 0, 7); pen.stroke();
        }
        pen.setLineDash([]);
        return;
      }
      for (let pass = 0; pass < 2; pass++) {
        pen.beginPath(); pen.arc(x, y, 8, 0, 7);
        pen.moveTo(x - 13, y); pen.lineTo(x - 8, y); pen.moveTo(x + 8, y); pen.lineTo(x + 13, y);
        pen.moveTo(x, y - 13); pen.lineTo(x, y - 8); pen.moveTo(x, y + 8); pen.lineTo(x, y + 13);
        pen.stroke();
        pen.strokeStyle = chosen ? '#ffe0ad' : '#bbb'; pen.lineWidth = 1.2;
      }
      if (held) label(lightAt(k).map((deg) => `${deg.toFixed(1)}°`).join(', '), x < 80 ? x + 16 : x - 16, y + 4, x < 80 ? 'left' : 'right');
    });
    pen.lineWidth = 1;
  }

  // ------------------------------------------------------------------------------------------------------ pictures
  self.show = (bitmap, fade) => {
    if (fade && self.image) { self.before = self.image; self.fadeFrom = performance.now(); } else { self.before = null; self.fadeFrom = 0; }
    self.image = bitmap;
    redraw();
  };
  self.refresh = latest(async (fade) => {
    const asked = self.mover.asked();
    // a newer picture triggers another call
    const { number, grade, current, lights: drawn } = app.state.picture;
    // a paused drag shows sharper pictures until it moves again; a picture of another place must not replace that of
    // the drag
    const late = () => (self.mover.live
      ? self.mover.busy() || self.mover.asked() !== asked || current || String(drawn) !== String(self.mover.lights)
      : self.shownGrade === 'moving' && !current);
    if (late()) return;
    const answer = await fetch(`api/picture?n=${number}`);
    if (!answer.ok) throw new Error((await answer.json()).error);
    const bitmap = await createImageBitmap(await answer.blob());
    if (late()) return;
    self.show(bitmap, fade);
    self.shownGrade = grade;
    self.shownNumber = number;
    app.status();
    if (['soon', 'final', 'working'].includes(grade)) { self.afterwards?.(); self.afterwards = null; }
    if (grade === 'soon' && self.released) self.stats.soon = performance.now() - self.released;
    if (grade === 'final' && self.released) { self.stats.final = performance.now() - self.released; self.released = 0; }
  });
  self.refreshTarget = latest(async () => {
    if (self.compare === 'physical') return;
    // during a drag the target follows it, and is redrawn at its end
    self.targetOld = self.mover.live;
    if (self.targetOld) { if (follow.last && !self.mover.busy()) followTarget({ ...follow.last, held: 1 }); return; }
    const answer = await fetch('api/target');
    if (!answer.ok) return;
    const bitmap = await createImageBitmap(await answer.blob());
    self.targetOld = self.mover.live;
    if (self.targetOld) return;
    self.target = bitmap;
    redraw();
  });
  self.see = (compare) => {
    // a hidden target is not updated, so it is outdated
    if (self.compare === 'physical') self.target = null;
    self.compare = compare;
    self.refreshTarget();
  };
  // The target follows a drag or playback a few times a second, leaving most of the time to the picture; it
  // is painted with the next picture.
  const follow = { values: null, last: null, running: false, stroke: 0 };
  async function followTarget(values) {
    follow.values = follow.last = values;
    if (follow.running || self.compare === 'physical') return;
    follow.running = true;
    try {
      while (follow.values && self.mover.live && self.compare !== 'physical') {
        const { values: now, stroke: mine } = follow;
        follow.values = null;
        const started = performance.now();
        const answer = await fetch(`api/target?${new URLSearchParams({ ...now, revision: app.state.revision })}`);
        const bitmap = answer.status === 200 ? await createImageBitmap(await answer.blob()) : null;
        // another drag may have started meanwhile
        if (bitmap && self.mover.live && mine === follow.stroke) { Object.assign(self, { target: bitmap, targetOld: true }); self.stats.targets.push(performance.now()); if (!self.mover.busy()) redraw(); }
        await new Promise((done) => { setTimeout(done, Math.min(Math.max(FOLLOW_MS, FOLLOW_PART * (performance.now() - started)), FOLLOW_MOST_MS)); });
      }
    } catch (error) { complain(error); } finally { follow.running = false; }
  }
  self.letGo = () => {
    follow.stroke += 1;
    follow.values = follow.last = null;
    self.mover.stop();
  };
  async function overlay(name) {
    const answer = await fetch(`api/outline?ghost=${encodeURIComponent(name)}`);
    return answer.ok ? createImageBitmap(await answer.blob()) : null;
  }
  self.refreshOutline = latest(async () => {
    const name = app.ghost;
    self.outline = name ? await overlay(name) : null;
    redraw();
  });
  self.hoverGhost = latest(async (name) => {
    self.hover = name && name !== app.ghost ? await overlay(name) : null;
    redraw();
  });

  // ----------------------------------------------------------------------------------------------------- the light
  self.mover = mover(app, (bitmap, lights, values) => {
    self.show(bitmap, false);
    followTarget(values);
    self.shownGrade = 'moving';
    self.shownNumber = -1;
    self.forget();
    app.status();
    app.lightsMoved(lights);
  });
  self.stats = Object.assign(self.mover.stats, { targets: [] });
  function moveLight(px, py, time) {
    const drag = self.drag;
    const [mx, my] = toMm(px - drag.offX, py - drag.offY);
    drag.now = anglesAt([mx, my], app.state.lights[drag.light]);
    // redraw the handle with the picture, as painting is the slow part
    self.mover.want({ light: drag.light, x: drag.now[0].toFixed(4), y: drag.now[1].toFixed(4) }, time);
    if (!self.mover.busy()) redraw();
  }
  // Store the result of a drag or playback by a command, and show the final picture, also without a change.
  self.settle = async (name, values, group) => {
    self.released = performance.now();
    self.letGo();
    const { revision } = app.state;
    try { await app.command(name, values, group); } catch { return; } finally {
      self.mover.lights = null;
      if (self.targetOld) self.refreshTarget();
      redraw();
    }
    if (app.state.revision === revision) await self.rest();
  };
  self.rest = async () => {
    await self.mover.idle();
    await post('api/rest');
    self.refresh(true);
  };
  async function dropLight() {
    const { light, now, group } = self.drag;
    const place = now ?? app.state.lights[light].field_deg;
    const { placed } = app.state.lights[light];
    if (placed) {
      const [mx, my] = placeOf(light, place);
      app.state.lights[light].placed = [mx / app.state.frame.sensor[0] + 0.5, 0.5 - my / app.state.frame.sensor[1]];
    }
    app.state.lights[light].field_deg = place.map((deg) => Number(deg.toFixed(4)));
    self.drag = null;
    // the place of the last picture
    await self.settle('move_light', { light, x: Number(place[0].toFixed(4)), y: Number(place[1].toFixed(4)) }, group);
  }

  // ---------------------------------------------------------------------------------------------------- annotating
  // ghosts lie on the line to the first light, also during a drag; their distance scales with the light's slope
  const slopes = () => lightAt(0).map((deg) => Math.tan(deg * Math.PI / 180));
  const direction = () => { const [x, y] = slopes(); const far = Math.hypot(x, y); return far ? [x / far, y / far] : [1, 0]; };
  const line = (mm) => direction().map((part) => part * mm);
  self.placeOf = (one) => one.per_slope * Math.hypot(...slopes());
  self.chosenKey = () => (app.ghostTarget !== null && app.ghostTarget !== undefined ? `w${app.ghostTarget}` : app.ghost);
  function targetCircles() {
    const ghostTargets = app.state.design?.ghost_targets ?? [];
    const out = self.places.map((one) => {
      const ghostTarget = ghostTargets.find((each) => each.ghost === one.name);
      const unmoved = self.placeOf(one);
      const place = (ghostTarget?.place_mm ?? unmoved) + (ghostTarget?.move_mm ?? 0);
      return { key: one.name, name: one.name, own: { place: unmoved, radius: one.radius }, place, radius: one.radius * (ghostTarget?.height ?? 1), changed: Boolean(ghostTarget), removed: ghostTarget?.action === 'remove' };
    });
    ghostTargets.forEach((ghostTarget, number) => {
      if (!ghostTarget.ghost) out.push({ key: `w${number}`, number, place: (ghostTarget.at_mm ? direction().reduce((sum, part, axis) => sum + part * ghostTarget.at_mm[axis], 0) : ghostTarget.place_mm) + ghostTarget.move_mm, radius: ghostTarget.radius_mm * ghostTarget.height, changed: true });
    });
    if (self.preview) for (const one of out) if (one.key === self.preview.key) Object.assign(one, self.preview);
    return out;
  }
  self.targetPlace = (number) => targetCircles().find((one) => one.key === `w${number}`)?.place;
  function grab(px, py) {
    if (!self.annotate) return null;
    const f = frame();
    const order = targetCircles().sort((a, b) => (b.key === self.chosenKey()) - (a.key === self.chosenKey()));
    for (const one of order) {
      if (one.key !== self.chosenKey() && !one.key.startsWith('w')) continue;
      const [x, y] = toPage(...line(one.place), f);
      const away = Math.hypot(px - x, py - y);
      const rim = Math.max(3, Math.abs(one.radius) * f.mm);
      if (Math.abs(away - rim) < 7 && rim > 9) return { kind: 'rim', one, away: Math.abs(away - rim) };
      if (away < Math.max(rim, 9)) return { kind: 'ghost', one, away, start: along(px, py) - one.place };
    }
    return null;
  }
  const along = (px, py) => { const mm = toMm(px, py); return direction().reduce((sum, part, axis) => sum + part * mm[axis], 0); };
  function pull(px, py) {
    const { kind, one, start } = self.drag;
    if (kind === 'ghost') self.preview = { key: one.key, place: along(px, py) - start, radius: one.radius };
    else {
      const [x, y] = toPage(...line(one.place));
      self.preview = { key: one.key, place: one.place, radius: Math.sign(one.radius || 1) * Math.max(0.02, Math.hypot(px - x, py - y) / frame().mm) };
    }
    redraw();
  }
  async function dropGhost() {
    const { one, group } = self.drag;
    const now = self.preview;
    self.drag = null;
    if (!now) return;
    const round = (value) => Number(value.toFixed(3));
    const ghostTarget = one.number !== undefined
      ? ['set_new_ghost_target', { number: one.number, values: { place_mm: round(now.place), at_mm: null, move_mm: 0, radius_mm: round(now.radius), height: 1 } }]
      : ['set_ghost_target', { ghost: one.name, values: { move_mm: round(now.place - one.own.place), height: Number(Math.max(0.01, Math.abs(now.radius / one.own.radius)).toFixed(4)) } }];
    // a rejected command shows an error, and the ghost returns to its place
    await app.command(...ghostTarget, group).catch(() => {});
    self.preview = null;
    redraw();
  }

  // -------------------------------------------------------------------------------------------------------- choosing
  async function pick(px, py) {
    const f = frame();
    const u = (px - f.x) / f.w;
    const v = (py - f.y) / f.h;
    if (u < 0 || v < 0 || u >= 1 || v >= 1) { app.choose(null); return; }
    // apply scrolling before the answer after it
    const asked = self.asked = { spot: [px, py], steps: 0 };
    try {
      const { ghosts } = await get(`api/pick?u=${u}&v=${v}`);
      if (self.asked !== asked) return;
      self.stack = ghosts;
      self.at = 0;
      self.spot = [px, py];
      self.spotFrame = JSON.stringify(f);
      app.choose(ghosts[0] ?? null);
      app.hint();
      if (asked.steps) self.walk(asked.steps);
    } catch (error) { complain(error); } finally { if (self.asked === asked) self.asked = null; }
  }
  // forget the ghosts under the pointer after a change: the wheel zooms again
  self.forget = () => {
    if (!self.spot) return;
    Object.assign(self, { stack: [], at: 0, spot: null });
    app.hint();
  };
  self.walk = (step) => {
    if (!self.stack.length) return;
    self.at = (((self.at + step) % self.stack.length) + self.stack.length) % self.stack.length;
    app.choose(self.stack[self.at], true);
    app.hint();
  };

  // -------------------------------------------------------------------------------------------------------- dragging
  // The light's handle or the chosen ghost, whichever is nearer: ghosts may lie next to the light.
  function under(px, py) {
    const away = ([, x, y]) => Math.hypot(px - x, py - y);
    const near = app.state.lights.map((_, k) => [k, ...handle(k)]).filter((one) => away(one) < NEAR_PX).sort((one, other) => away(one) - away(other))[0];
    const taken = grab(px, py);
    return near && !(taken && taken.away < Math.hypot(px - near[1], py - near[2])) ? { near, taken: null } : { near: null, taken };
  }
  const local = (event) => { const rect = canvas.getBoundingClientRect(); return [event.clientX - rect.left, event.clientY - rect.top]; };
  canvas.addEventListener('pointerdown', (event) => {
    if (!app.state) return;
    // no selection and no browser drag
    event.preventDefault();
    canvas.focus();
    canvas.setPointerCapture(event.pointerId);
    const [px, py] = local(event);
    const f = frame();
    if (event.button === 1 || (event.button === 0 && (event.altKey || self.space))) { self.drag = { kind: 'pan', px, py, x: self.panX, y: self.panY }; return; }
    if (event.button !== 0) return;
    if (self.compare === 'wipe' && Math.abs(px - f.x - f.w * self.wipe) < 7) { self.drag = { kind: 'wipe' }; return; }
    const { near, taken } = under(px, py);
    if (taken) { self.drag = { ...taken, px, py, group: stroke() }; return; }
    const light = near ? near[0] : app.light;
    if (near) app.chooseLight(light);
    const [lx, ly] = near ? [near[1], near[2]] : lightPage(light);
    // a drag far from the handle moves the light by the same distance
    self.drag = { kind: 'maybe', near: Boolean(near), light, px, py, offX: px - lx, offY: py - ly, group: stroke() };
  });
  canvas.addEventListener('pointermove', (event) => {
    const drag = self.drag;
    if (!drag) { const [px, py] = local(event); cursor(px, py); return; }
    const [px, py] = local(event);
    if (drag.kind === 'pan') { self.panX = drag.x + px - drag.px; self.panY = drag.y + py - drag.py; redraw(); return; }
    if (drag.kind === 'wipe') { const f = frame(); self.wipe = Math.max(0, Math.min(1, (px - f.x) / f.w)); redraw(); return; }
    if (drag.kind === 'ghost' || drag.kind === 'rim') { pull(px, py); return; }
    if (drag.kind === 'maybe' && Math.hypot(px - drag.px, py - drag.py) >= CLICK_PX) { drag.kind = 'light'; self.hover = null; self.mover.lights = null; app.player.halt(); }
    if (drag.kind === 'light') moveLight(px, py, performance.now());
  });
  async function letGo(event) {
    const drag = self.drag;
    if (!drag) return;
    if (drag.kind === 'light') await dropLight();
    else if (drag.kind === 'ghost' || drag.kind === 'rim') await dropGhost();
    else { self.drag = null; if (event.type === 'pointerup' && drag.kind === 'maybe' && !drag.near) pick(...local(event)); }
    redraw();
  }
  // a drag ended by the browser keeps its result
  for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) canvas.addEventListener(end, letGo);
  canvas.addEventListener('dragstart', (event) => event.preventDefault());
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    const [px, py] = local(event);
    const near = (spot) => spot && Math.hypot(px - spot[0], py - spot[1]) < 12;
    const step = event.deltaY > 0 ? 1 : -1;
    if (near(self.asked?.spot)) { self.asked.steps += step; return; }
    if (near(self.spot) && self.stack.length > 1) { self.walk(step); return; }
    self.zoomBy(Math.exp(-event.deltaY * 0.0015), px, py);
  }, { passive: false });
  // zoom about a fixed place
  self.zoomBy = (times, px = half() / 2, py = box().h / 2) => {
    const before = frame();
    const u = (px - before.x) / before.w;
    const v = (py - before.y) / before.h;
    self.zoom = Math.max(0.15, Math.min(24, self.zoom * times));
    const after = frame();
    self.pan(px - (after.x + u * after.w), py - (after.y + v * after.h));
  };
  self.pan = (dx, dy) => { self.panX += dx; self.panY += dy; redraw(); };
  self.moveWipe = (by) => { if (self.compare === 'wipe') { self.wipe = Math.max(0, Math.min(1, self.wipe + by)); redraw(); } };
  function cursor(px, py) {
    const { near, taken } = app.state ? under(px, py) : {};
    canvas.style.cursor = near ? 'grab' : taken ? (taken.kind === 'rim' ? 'nwse-resize' : 'move') : 'crosshair';
  }
  self.fit = (zoom = 1) => { self.zoom = zoom; self.panX = 0; self.panY = 0; redraw(); };
  self.redraw = redraw;
  self.frame = frame;
  self.lightPage = lightPage;
  self.toPage = toPage;
  self.line = line;
  new ResizeObserver(redraw).observe(canvas);
  return self;
}
