// Panels and controls for lenses only: with a measured flare, a panel explains why it is empty, and controls are hidden.
import { h } from './ui.js';

const WHY = 'A measured flare has no prescription: its ghosts come from photographs. Move and colour its light on the panel Light; mute, brighten and tint its ghosts on the panel Ghosts.';

export function panelOfLens(panel) {
  const words = h('p', { class: 'group quietly' }, WHY);
  return {
    ...panel,
    element: h('div', {}, words, panel.element),
    update(state) {
      words.hidden = !state.lens.measured;
      panel.element.hidden = Boolean(state.lens.measured);
      if (!state.lens.measured) panel.update?.(state);
    },
  };
}

// `but`: whether a measured flare has the control as well.
export function ofLens(control, but = () => false) {
  return {
    element: control.element,
    update(state) {
      control.element.hidden = Boolean(state.lens.measured) && !but(state);
      if (!control.element.hidden) control.update?.(state);
    },
  };
}
