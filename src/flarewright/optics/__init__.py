"""Physics of lenses and flare on arrays; no file access and no rendering.

- `lens`: paraxial optics, light paths, dispersion, surface shapes, zoom, tolerances
- `lens_import`: validation and repair of imported prescriptions
- `rays`: packed lenses, ray bundles, the ghost table
- `pupil`: iris, dirt and light shapes
- `coatings`: thin films and standard coatings
- `diffraction`: Fraunhofer starburst and Fresnel ringing
- `scattering`: surface scatter, dust, sensor grating, veiling glare
- `colour`: spectra, the CIE observer, RGB
"""
