"""Pictures of the editor: drafts during a drag, final pictures at rest, and diagrams.

Public entry points: `viewport.Screen`, `drag.Drag`, `progressive_render.sharpen`, `queries`.

- `viewport`: `Screen` holds the shown picture and schedules rendering
- `progressive_render`: `sharpen` renders draft, traced preview and final picture in turn
- `drag`: `Drag` draws pictures during a drag, at a size that keeps up
- `render_picture`: `take` renders one picture; sizes, quality and exposure
- `picture`: `DrawnPicture`, the rendered result
- `display_image`: exposure, look, JPEG and PNG
- `plate_view`: the plate under the flare, and the comp of both
- `draft_match`: `Match`, the gains that match drafts to final pictures
- `draft_calibration`: these gains as a function of the field angle
- `ghost_picking`: `see`, every ghost drawn alone; `under`, those at a place
- `queries`: requests of the page to a screen: `picked`, the ghosts of a click in their order; target picture, outline
- `diagrams`: cross-section, coating charts, colour maps, library
"""
