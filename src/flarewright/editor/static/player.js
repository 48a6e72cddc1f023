// Playback and scrubbing of the lights' paths; the project changes only at the end.
export function player(app) {
  const self = { at: 0, playing: false, loop: localStorage.getItem('loop') !== 'no', heard: () => {} };
  let from = 0;
  let started = 0;
  const end = () => app.state?.path_s ?? 0;
  // also by curves of intensity, colour, f-number and others, which a file has
  self.keyed = () => Boolean(app.state?.moves);
  self.setLoop = (loop) => { self.loop = loop; localStorage.setItem('loop', loop ? 'yes' : 'no'); self.heard(); };

  function frame(now) {
    if (!self.playing) return;
    // the path was removed
    if (end() <= 0) { self.halt(); return; }
    let at = from + (now - started) / 1000;
    if (at > end()) {
      if (!self.loop) { self.at = end(); self.stop(); return; }
      from = at % end();
      started = now;
      at = from;
    }
    self.at = at;
    show(now);
    requestAnimationFrame(frame);
  }
  function show(time = performance.now()) {
    app.view.mover.want({ at: self.at.toFixed(3) }, time);
    self.heard();
  }
  self.play = () => {
    if (self.playing || end() <= 0) return;
    self.playing = true;
    from = self.at >= end() ? 0 : self.at;
    started = performance.now();
    requestAnimationFrame(frame);
  };
  self.stop = () => {
    self.playing = false;
    self.heard();
    return self.rest();
  };
  // end playback without a change, for a drag or another project
  self.halt = () => {
    if (!self.playing) return;
    self.playing = false;
    // pictures of the project are shown again
    app.view.letGo();
    self.heard();
  };
  self.reset = () => { self.halt(); self.at = 0; self.heard(); };
  self.toggle = () => (self.playing ? self.stop() : self.play());
  // scrub: a draft at once, and the final picture at rest
  self.scrub = (at) => {
    self.playing = false;
    self.at = Math.max(0, at);
    if (self.keyed()) show(); else self.heard();
  };
  // consecutive moves form one step of the history
  self.rest = () => {
    if (self.keyed()) return app.view.settle('go_to', { at_s: Number(self.at.toFixed(3)) }, 'go_to');
    // nothing moves, so nothing is stored, and pictures of the project are shown again
    app.view.letGo();
    return Promise.resolve();
  };
  self.go = (at) => { self.playing = false; self.at = Math.max(0, at); self.heard(); return self.rest(); };
  self.key = async () => {
    // the place that is shown, not that of before playback
    if (self.playing) await self.stop();
    return app.command('set_key', { light: app.light, at_s: Number(self.at.toFixed(2)) }).catch(() => {});
  };
  self.step = (by) => {
    const times = [...new Set(app.state.lights.flatMap((light) => light.keys.map((key) => key.at_s)))].sort((a, b) => a - b);
    const next = by > 0 ? times.find((at) => at > self.at + 0.005) : times.reverse().find((at) => at < self.at - 0.005);
    if (next !== undefined) self.go(next);
  };
  return self;
}
