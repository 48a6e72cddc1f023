"""Records of projects and scenes: what is rendered, designed or predicted.

`flarewright.model` re-exports most public records.

- `animation`: `Curve`, a value over time, and `Timeline`, the frames of a shot
- `art`: `Art` and its `Rule`, art direction
- `backplate`: `Backplate`, a photograph under the flare, and `PlateSearch`, how its lights were found
- `camera`: `Camera`, sensor and picture size
- `dataset`: `DatasetSpec`, the distributions of training pairs
- `distribution`: `Distribution` of numbers and `Texts`, choices of texts
- `design`: `Design`, `Bounds`, `GhostTarget`, settings of the lens design
- `holdout`: `Holdout`, objects that hide lights
- `light`: `Light`, its shapes and spectra
- `look`: `Look`, reusable settings of a flare
- `project`: `Project`, `Quality`, `Output`, coating choices
- `reference_state`: `ReferenceState`, an interrupted reference render
- `scene`: `Scene` with its cameras and lights, for light planning
- `starburst`: `Starburst` and `Dirt`
"""
