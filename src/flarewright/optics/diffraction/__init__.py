"""Diffraction at the iris: the starburst (Fraunhofer) and ringing in ghosts (Fresnel).

- `collins`: `stop_to_sensor`, `frft_fresnel_number`, `ripple_height`, Fresnel areas of ghosts
- `edge_patterns`: `averaged`, `edge_tables`, tables of edges and corners for large blades
- `fft_size`: `fast_size`, array lengths with fast transforms
- `fraunhofer`: `pupil_pattern`, starburst patterns
- `fresnel`: `fresnel_grid`, `band_pattern`, `fresnel_intensity`, patterns of any opening by FFT
- `spike_profile`: `spike_profile`, flux across the spikes of a starburst
- `table_blocks`: `TableBlocks`, `common_block`, memory of many tables that a kernel reads as one array
"""
