// Pictures of what moves, by a hand or along a path: as many as the server makes, and always of the newest place.
import { complain } from './api.js';

export function mover(app, shown) {
  // two are under way, so that neither side waits
  let under = 0;
  let next = null;
  let sent = 0;
  let received = 0;
  let asked = 0;
  let usual = 30;
  let waiting = 0;
  const self = { live: false, lights: null, stats: { shown: [], latency: [], server: [] } };
  self.want = (query, time) => { self.live = true; next = { query, time }; pump(); };
  self.stop = () => { self.live = false; next = null; };
  self.busy = () => under > 0;
  // what is under way ends final pictures: whoever wants one waits for it
  self.idle = async () => { while (under > 0) await new Promise((done) => { setTimeout(done, 5); }); };

  function pump() {
    if (!next || under >= 2) return;
    // the second one leaves shortly before the first is done, so that it asks for the newest place
    const early = under === 1 ? asked + 0.6 * usual - performance.now() : 0;
    if (early > 1) {
      waiting ||= setTimeout(() => { waiting = 0; pump(); }, early);
      return;
    }
    const now = next;
    next = null;
    under += 1;
    asked = performance.now();
    ask(now, ++sent).finally(() => { under -= 1; pump(); });
  }
  async function ask(now, number) {
    try {
      const answer = await fetch(`/api/moving?${now.query}&revision=${app.state.revision}`);
      if (answer.status === 204) return;
      if (!answer.ok) throw new Error((await answer.json()).error);
      const lights = JSON.parse(answer.headers.get('X-Lights'));
      const bitmap = await createImageBitmap(await answer.blob());
      if (number < received || !self.live) return;
      received = number;
      self.lights = lights;
      shown(bitmap, lights);
      const seconds = Number(answer.headers.get('X-Seconds'));
      usual += 0.2 * (1000 * seconds - usual);
      self.stats.server.push(seconds);
      requestAnimationFrame((time) => { self.stats.shown.push(time); self.stats.latency.push(performance.now() - now.time); });
    } catch (error) { complain(error); }
  }
  return self;
}
