"""Spectra and colours.

- `cie1931`: `cie_1931`, the colour matching functions, and daylight D65
- `rgb`: `xyz_to_rgb_matrix`, `luminance_weights`, `oklab`, `brightest_channel`
- `rgb_to_spectrum`: `uplift`, smooth spectra of colours
- `spectrum`: `traced_wavelengths`, `band_weights`, `spectral_power`, spectra of lights
"""
