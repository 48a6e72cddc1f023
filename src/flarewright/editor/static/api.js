// Requests to the server, and toasts with its error messages. Addresses are relative: a proxy may put a path before them.
import { hush, toast } from './ui.js';

export const socketAddress = (path) => new URL(path, document.baseURI).href.replace(/^http/, 'ws');

export async function get(path) {
  const answer = await fetch(path);
  hush('lost');
  const data = await answer.json();
  if (!answer.ok) throw new Error(data.error || answer.statusText);
  return data;
}

// Number of changes on their way to the server.
export const under = { way: 0 };

export async function post(path, body) {
  under.way += 1;
  try { return await send(path, body); } finally { under.way -= 1; }
}

async function send(path, body) {
  const raw = body instanceof Blob || body instanceof ArrayBuffer;
  const answer = await fetch(path, {
    method: 'POST',
    headers: raw ? {} : { 'Content-Type': 'application/json' },
    body: raw ? body : JSON.stringify(body ?? {}),
  });
  hush('lost');
  if (answer.status === 413) throw new Error('This file is larger than the editor reads, 256 MB.');
  const data = await answer.json();
  if (!answer.ok) throw new Error(data.error || answer.statusText);
  return data;
}

export const sentence = (text) => {
  const plain = String(text).trim();
  // do not capitalise the name of a file or a field
  const name = /^\S+[._]\w+\b/.test(plain) || /^(?!(?:cannot|the|an?) )[^:;,]+\.\w{2,5}(?:: | (?:is|has|does|holds|was|cannot) )/.test(plain);
  return (name ? plain.charAt(0) : plain.charAt(0).toUpperCase()) + plain.slice(1) + (/[.!?]$/.test(plain) ? '' : '.');
};

export function inWords(error) {
  return isLost(error) ? LOST : sentence(error.message);
}
const isLost = (error) => error instanceof TypeError && /fetch/i.test(error.message);
// shown once, until the connection is back
export const LOST = 'The editor does not answer. All changes so far are saved; start flarewright edit again.';
export const complain = (error, about = '') => (isLost(error) ? toast(LOST, 'error', Infinity, 'lost') : toast(inWords(error), 'error', 9000, about));

// Run one call at a time: while it runs, only the newest later call waits. The returned promise waits for all.
export function latest(work) {
  let running = null;
  let next = null;
  async function run() {
    while (next) {
      const now = next;
      next = null;
      try { await work(...now); } catch (error) { complain(error); }
    }
    running = null;
  }
  return function call(...values) {
    next = values;
    running ??= run();
    return running;
  };
}

// A queue: calls run one after another in the order of the requests, so that a save right after an edit includes it.
// Of adjacent waiting calls of one stroke only the newest runs, for all of them.
export function inLine() {
  const waiting = [];
  let running = false;
  async function run() {
    running = true;
    while (waiting.length) {
      const { work, done, failed } = waiting.shift();
      try { done(await work()); } catch (error) { failed(error); }
    }
    running = false;
  }
  return function add(work, stroke = '') {
    let one = waiting.at(-1);
    if (stroke && one?.stroke === stroke) one.work = work;
    else {
      one = { work, stroke };
      one.answer = new Promise((done, failed) => { Object.assign(one, { done, failed }); });
      waiting.push(one);
    }
    if (!running) run();
    return one.answer;
  };
}
