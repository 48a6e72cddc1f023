// Plays the paths of the lights, or goes along them by hand; nothing is changed until it stops.
export function player(app) {
  const self = { at: 0, playing: false, loop: localStorage.getItem('loop') !== 'no', heard: () => {} };
  let from = 0;
  let begun = 0;
  const end = () => app.state?.path_s ?? 0;
  self.keyed = () => Boolean(app.state?.lights.some((light) => light.keys.length));
  self.setLoop = (loop) => { self.loop = loop; localStorage.setItem('loop', loop ? 'yes' : 'no'); self.heard(); };

  function frame(now) {
    if (!self.playing) return;
    // its path is gone
    if (end() <= 0) { self.halt(); return; }
    let at = from + (now - begun) / 1000;
    if (at > end()) {
      if (!self.loop) { self.at = end(); self.stop(); return; }
      from = at % end();
      begun = now;
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
    begun = performance.now();
    requestAnimationFrame(frame);
  };
  self.stop = () => {
    self.playing = false;
    self.heard();
    return self.rest();
  };
  // where a hand takes the light, or another project comes, nothing plays on
  self.halt = () => {
    if (!self.playing) return;
    self.playing = false;
    // nothing moves any more: what is drawn of the project counts again
    app.view.letGo();
    self.heard();
  };
  self.reset = () => { self.halt(); self.at = 0; self.heard(); };
  self.toggle = () => (self.playing ? self.stop() : self.play());
  // by hand: a draft at once, and the final picture when the hand rests
  self.scrub = (at) => {
    self.playing = false;
    self.at = Math.max(0, at);
    if (self.keyed()) show(); else self.heard();
  };
  // goes of one kind follow each other as one step of the history
  self.rest = () => (self.keyed() ? app.view.settle('go_to', { at_s: Number(self.at.toFixed(3)) }, 'go_to') : Promise.resolve());
  self.go = (at) => { self.playing = false; self.at = Math.max(0, at); self.heard(); return self.rest(); };
  self.key = () => app.deed('set_key', { light: app.light, at_s: Number(self.at.toFixed(2)) }).catch(() => {});
  self.step = (by) => {
    const times = [...new Set(app.state.lights.flatMap((light) => light.keys.map((key) => key.at_s)))].sort((a, b) => a - b);
    const next = by > 0 ? times.find((at) => at > self.at + 0.005) : times.reverse().find((at) => at < self.at - 0.005);
    if (next !== undefined) self.go(next);
  };
  return self;
}
