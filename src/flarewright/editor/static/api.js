// Asking the server, and telling a person what went wrong in its words.
import { hush, toast } from './ui.js';

export async function get(path) {
  const answer = await fetch(path);
  hush('lost');
  const data = await answer.json();
  if (!answer.ok) throw new Error(data.error || answer.statusText);
  return data;
}

// How many changes are on their way to the server.
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
  const data = await answer.json();
  if (!answer.ok) throw new Error(data.error || answer.statusText);
  return data;
}

export const sentence = (text) => {
  const plain = String(text).trim();
  // a file keeps its name as it is, and so does a field
  const name = /^\S+[._]\w+\b/.test(plain) || /^(?!cannot )[^:]+\.\w{2,5}: /.test(plain);
  return (name ? plain.charAt(0) : plain.charAt(0).toUpperCase()) + plain.slice(1) + (/[.!?]$/.test(plain) ? '' : '.');
};

export function inWords(error) {
  return isLost(error) ? LOST : sentence(error.message);
}
const isLost = (error) => error instanceof TypeError && /fetch/i.test(error.message);
// for as long as it is so, and once
export const LOST = 'The editor does not answer. Everything up to here is saved; start flarewright edit again.';
export const complain = (error, about = '') => (isLost(error) ? toast(LOST, 'error', Infinity, 'lost') : toast(inWords(error), 'error', 9000, about));

// Only the newest call counts: while one is under way, the last of the others waits. What is returned waits for all.
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

// One after another, in the order in which they were asked for: what is saved or undone right behind a number is saved or
// undone with it. Of those of one stroke that wait next to each other only the newest is done, for all of them.
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
