// The lenses that ship, each with its flare.
import { get } from './api.js';
import { h } from './ui.js';

export function libraryPanel(app) {
  let lenses = null;
  const box = h('input', { type: 'text', placeholder: 'Search by name, maker or patent', name: 'search', style: 'width:100%', tip: 'Every word must occur in name, maker, patent or f-number.', 'aria-label': 'Search lenses' });
  const shelf = h('div', { class: 'library' });
  // its line is kept free, so that nothing moves below a hand when it has been said
  const told = h('p', { class: 'quietly', style: 'min-height:16px' });
  const watcher = new IntersectionObserver((entries) => { for (const each of entries) if (each.isIntersecting) { each.target.src = each.target.dataset.src; watcher.unobserve(each.target); } tell(); });
  const drawing = () => [...shelf.querySelectorAll('img[src]')].some((image) => !image.complete);
  function tell() {
    const none = shelf.children.length ? '' : 'No lens is called like this. A lens file can be dropped on the page.';
    told.textContent = drawing() ? 'The flares are being drawn; this is done once on a machine.' : none;
  }
  box.addEventListener('input', draw);
  async function choose(name) { try { await app.deed('choose_lens', { lens: name }); } catch (error) { void error; } }
  function draw() {
    if (!lenses) return;
    const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
    const all = lenses.filter((lens) => words.every((word) => lens.words.includes(word)));
    shelf.replaceChildren(...all.map((lens) => {
      const image = h('img', { alt: '', 'data-src': `/api/thumbnail/${lens.name}`, loading: 'lazy', onload: tell, onerror: tell });
      watcher.observe(image);
      return h('button', { type: 'button', class: app.state?.lens.shipped === lens.name ? 'on' : '', 'data-lens': lens.name, onclick: () => choose(lens.name), tip: lens.source }, image, h('span', {}, lens.title), h('small', {}, `f/${lens.f_number} · ${lens.rows - 1} surfaces`));
    }));
    tell();
  }
  return {
    element: h('div', {}, h('div', { class: 'group' }, box, told), shelf),
    async shown() { if (!lenses) { try { lenses = (await get('/api/library')).lenses; draw(); } catch (error) { void error; } } },
    update(state) { for (const each of shelf.children) each.classList.toggle('on', each.dataset.lens === state.lens.shipped); },
  };
}
