"""Image files: EXR, PNG, photographs, and the images that projects refer to.

- `contact_sheet`: `write_contact_sheet`, small pictures on one page and in one picture
- `cryptomatte`: `matte_layers`, `matte_attributes`, `identifier`, a matte of ghosts as a Cryptomatte
- `exr`: `write_exr` and `read_exr` for layers; `exr_note`
- `foreign_exr`: `read_exr_plane`, `read_exr_grey`, `read_exr_layer` for EXR files of other programs
- `exr_attributes`: `shot_attributes`, OpenEXR's standard attributes of a frame
- `file_space`: `FileSpace`: linear colour spaces beside Rec.709 and ACEScg
- `half`: `exr_scale`, `rounded_to_half`, scale and rounding of half floats
- `height_image`: `read_heights`, figure errors of surfaces
- `html_page`: `html_page`, pages and sections of pages from templates
- `mask_image`: `read_mask`, iris and dirt images; `read_grey`
- `photo`: `open_photo`, photographs with linear values (RAW, TIFF, EXR, NPY); `photo_facts`, their EXIF tags
- `picture`: `read_picture`, any colour picture as linear RGB; `decode_srgb`
- `plate_picture`: `read_plate`, photographs and rendered pictures in which lights are found
- `plate_image`: `read_matte` and `read_depth`, holdouts
- `png`: `write_png`, `encode_png`, `png_address`
- `sample_png`: `encode_samples`, PNG files of 8 or 16 bits for training data
- `tiff_numbers`: `refuse_inks`, TIFF files whose numbers are not light
- `transfer`: `decoded`, linear values of the codes of pictures and films
- `thumbnails`: `thumbnail`, precomputed pictures of the library
"""
