// Asking the server, and telling a person what went wrong in its words.
import { toast } from './ui.js';

export async function get(path) {
  const answer = await fetch(path);
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
  const lost = error instanceof TypeError && /fetch/i.test(error.message);
  return lost ? 'The editor does not answer. Start flarewright edit again; nothing is lost.' : sentence(error.message);
}
export const complain = (error, about = '') => toast(inWords(error), 'error', 9000, about);

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
