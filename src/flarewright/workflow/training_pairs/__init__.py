"""Training pairs for the removal and the detection of lens flare (docs/datasets.md).

- `run`: `dataset` draws a data set on all cores, with a `DatasetResult`
- `item`: `write_item`, one of them, and what is already there
- `layout`: `item_files`, the files of an item in the layout of a folder, of WebDataset or of Flare7K
- `pictures`: `draw_pictures`, background, flare, masks and what the sensor records
- `masks`: `light_mask` and `ghost_mask`
- `sensor`: `exposed`, noise and clipping, and `codes`, the tone curve
- `background`: `background_of`, crops of a folder's pictures, or synthetic pictures
- `draw`: `draw_item`, the values of an item, and `splits_of`, the splits by lens
- `preview`: `preview_picture`, a contact sheet
"""
