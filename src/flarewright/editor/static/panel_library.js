// The user's lenses, the shipped lenses and the looks, each with a picture.
import { get, inWords } from './api.js';
import { h } from './ui.js';

export function libraryPanel(app) {
  let lenses = null;
  let looks = [];
  const box = h('input', { type: 'text', placeholder: 'Search by name, maker, patent or look', name: 'search', style: 'width:100%', tip: 'Finds entries that contain every word in name, maker, patent, f-number or notes.', 'aria-label': 'Search lenses and looks' });
  const lensGrid = h('div', { class: 'library' });
  const lookGrid = h('div', { class: 'library', id: 'looks' });
  const heading = h('h3', { class: 'quietly', style: 'margin:8px 14px 0', tip: 'A look sets coatings, iris, dirt and colours of the present lens and lights. Undo reverts it.' }, 'Looks');
  const reported = h('p', { class: 'quietly' }, 'Reading the library…');
  heading.hidden = true;
  box.addEventListener('input', draw);
  async function choose(name) { try { await app.command('choose_lens', { lens: name }); } catch (error) { void error; } }
  async function wear(name) { try { await app.command('put_look', { name }); } catch (error) { void error; } }
  function picture(kind, name, own = false) {
    const address = `api/thumbnail/${kind}/${encodeURIComponent(name)}`;
    const image = h('img', { alt: '', src: address, loading: 'lazy' });
    let tries = 0;
    // pictures of the user's lenses are rendered in the background; ask again, ever less often, while they are shown
    image.addEventListener('load', () => { image.style.visibility = ''; });
    if (own) image.addEventListener('error', () => { image.style.visibility = 'hidden'; tries += 1; setTimeout(() => { if (image.isConnected) image.src = `${address}?again=${tries}`; }, Math.min(3000 * tries, 30000)); });
    return image;
  }
  function draw() {
    if (!lenses) return;
    const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
    const matching = (all) => all.filter((one) => words.every((word) => one.words.includes(word)));
    lensGrid.replaceChildren(...matching(lenses).map((lens) => h('button', { type: 'button', class: app.state?.lens.shipped === lens.name ? 'on' : '', 'data-lens': lens.name, onclick: () => choose(lens.name), tip: lens.source }, picture('lens', lens.name, lens.own), h('span', {}, lens.title), h('small', {}, `f/${lens.f_number} · ${lens.rows - 1} surfaces${lens.own ? ' · yours' : ''}`))));
    lookGrid.replaceChildren(...matching(looks).map((look) => h('button', { type: 'button', 'data-look': look.name, onclick: () => wear(look.name), tip: look.notes }, picture('look', look.name), h('span', {}, look.title))));
    heading.hidden = !lookGrid.children.length;
    reported.textContent = lensGrid.children.length || lookGrid.children.length ? '' : 'No lens or look matches. A lens file can be dropped on the page.';
  }
  return {
    element: h('div', {}, h('div', { class: 'group' }, box, reported), lensGrid, heading, lookGrid),
    async shown() { try { const known = JSON.stringify(lenses); ({ lenses, looks } = await get('api/library')); if (JSON.stringify(lenses) !== known) draw(); } catch (error) { if (!lenses) reported.textContent = inWords(error); } },
    update(state) { for (const each of lensGrid.children) each.classList.toggle('on', each.dataset.lens === state.lens.shipped); },
  };
}
