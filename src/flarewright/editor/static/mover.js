// Pictures during a drag or playback: as many as the server can draw, always of the newest place.
import { complain, socketAddress } from './api.js';

export function mover(app, shown) {
  // two requests at a time, so that neither side waits
  let under = 0;
  let next = null;
  let sent = 0;
  let received = 0;
  let asked = 0;
  let usual = 30;
  let waiting = 0;
  const self = { live: false, lights: null, stats: { shown: [], latency: [], server: [] } };
  self.want = (values, time) => { self.live = true; next = { values, time }; pump(); };
  self.stop = () => { self.live = false; next = null; };
  self.busy = () => under > 0;
  self.asked = () => sent;
  // a request in progress interrupts final pictures, so wait for it before requesting one
  self.idle = async () => { while (under > 0) await new Promise((done) => { setTimeout(done, 5); }); };

  function pump() {
    if (!next || under >= 2) return;
    // send the second request shortly before the first is done, so that it has the newest place
    const early = under === 1 ? asked + 0.9 * usual - performance.now() : 0;
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
  // one socket for all pictures: cheaper than a request for each
  let socket = null;
  const waits = new Map();
  function opened() {
    socket ??= new Promise((done, failed) => {
      const made = new WebSocket(socketAddress('ws/moving'));
      made.binaryType = 'arraybuffer';
      made.onopen = () => done(made);
      made.onmessage = ({ data }) => {
        const bytes = new Uint8Array(data);
        const end = bytes.indexOf(10);
        const head = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
        waits.get(head.number)?.done([head, bytes.subarray(end + 1)]);
        waits.delete(head.number);
      };
      made.onclose = () => {
        socket = null;
        const lost = new TypeError('fetch: the editor is gone');
        failed(lost);
        for (const each of waits.values()) each.failed(lost);
        waits.clear();
      };
    });
    return socket;
  }
  async function answered(values, number) {
    const line = await opened();
    return new Promise((done, failed) => {
      waits.set(number, { done, failed });
      line.send(JSON.stringify({ ...values, number, revision: app.state.revision }));
    });
  }
  async function ask(now, number) {
    try {
      const [head, bytes] = await answered(now.values, number);
      if (head.error) throw new Error(head.error);
      if (!bytes.length) return;
      const { lights, seconds } = head;
      const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/jpeg' }));
      if (number < received || !self.live) return;
      received = number;
      self.lights = lights;
      shown(bitmap, lights, now.values);
      usual += 0.2 * (1000 * seconds - usual);
      self.stats.server.push(seconds);
      requestAnimationFrame((time) => { self.stats.shown.push(time); self.stats.latency.push(performance.now() - now.time); });
    } catch (error) { complain(error); }
  }
  return self;
}
