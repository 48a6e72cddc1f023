// The cross-section in its strip: the server's drawing without its frame, with readable row numbers.

// Remove the drawing's title and footer, which the head of the strip shows already, and scale the lens to the strip of
// `across` by `down` px.
export function fitted(svg, across, down) {
  const [, , width, height] = svg.getAttribute('viewBox').split(' ').map(Number);
  svg.querySelectorAll('text').forEach((text) => { if (Number(text.getAttribute('y')) < 30) text.remove(); });
  svg.querySelector('title')?.remove();
  svg.querySelector('rect[width="100%"]')?.remove();
  svg.removeAttribute('width');
  svg.removeAttribute('height');
  svg.querySelectorAll('text').forEach((text) => { if (Number(text.getAttribute('y')) > height - 30) text.remove(); });
  svg.querySelectorAll('line').forEach((each) => { if (Number(each.getAttribute('y1')) > height - 30) each.remove(); });
  const names = [...svg.querySelectorAll('text')];
  names.forEach((text) => text.remove());
  const box = svg.getBBox();
  const clip = svg.querySelector('clipPath rect');
  const top = Math.max(box.y, clip ? Number(clip.getAttribute('y')) : 0);
  const low = Math.min(box.y + box.height, clip ? Number(clip.getAttribute('y')) + Number(clip.getAttribute('height')) : height);
  const [left, wide] = [Math.max(0, box.x) - 4, Math.min(box.width, width) + 8];
  number(svg, names, { left, wide, top, height: low - top + 4 }, across, down);
}

// Places for labels in a row without overlap, as near as possible to the wanted ones: labels that would overlap form a
// cluster around their mean (isotonic regression of the places minus the widths before them).
function spread(wanted, widths) {
  const before = widths.map((width, k) => widths.slice(0, k).reduce((sum, each) => sum + each, 0) + width / 2);
  const clusters = [];
  wanted.forEach((place, k) => {
    clusters.push({ mean: place - before[k], count: 1 });
    while (clusters.length > 1 && clusters.at(-2).mean > clusters.at(-1).mean) {
      const [one, other] = clusters.splice(-2);
      const count = one.count + other.count;
      clusters.push({ mean: (one.count * one.mean + other.count * other.mean) / count, count });
    }
  });
  return clusters.flatMap(({ mean, count }) => Array(count).fill(mean)).map((place, k) => place + before[k]);
}

// Draw row numbers at text size for any scale; spread the numbers of close rows, each with a line to its row.
function number(svg, names, { left, wide, top, height }, across, down) {
  const widths = names.map((text) => 7 * text.textContent.length + 4);
  // if the strip is too narrow, show every n-th number
  const every = Math.ceil(widths.reduce((sum, each) => sum + each, 0) / across);
  const some = (_, k) => k % every === 0;
  const fits = names.filter(some);
  const rows = fits.map((text) => Number(text.getAttribute('x')));
  const placed = (scale) => spread(rows.map((x) => x * scale), widths.filter(some));
  const scaled = (numbers) => Math.min(across / wide, (down - numbers) / (height + 2));
  // lines are longer if numbers are far from their rows
  const rough = scaled(20);
  const away = Math.max(0, ...placed(rough).map((place, k) => Math.abs(place - rows[k] * rough)));
  const leads = Math.min(26, 4 + 0.3 * away);
  const scale = scaled(11 + leads);
  const foot = top - 2 - leads / scale;
  const over = (11 + leads) / scale;
  const places = placed(scale);
  // the drawing is centred in its strip; keep the numbers inside
  const middle = (left + wide / 2) * scale;
  const aside = Math.max(0, middle - across / 2 - places[0] + 10) - Math.max(0, places.at(-1) + 10 - middle - across / 2);
  places.forEach((place, k) => {
    const x = (place + aside) / scale;
    const lead = document.createElementNS(svg.namespaceURI, 'line');
    const line = { class: 'lead', x1: x, y1: foot + 2 / scale, x2: rows[k], y2: top - 1, 'stroke-width': 0.7 / scale };
    Object.entries(line).forEach(([key, value]) => lead.setAttribute(key, value));
    fits[k].setAttribute('x', x);
    fits[k].setAttribute('y', foot);
    fits[k].style.fontSize = `${10.5 / scale}px`;
    svg.append(lead, fits[k]);
  });
  svg.setAttribute('viewBox', `${left} ${top - 2 - over} ${wide} ${height + over}`);
}
