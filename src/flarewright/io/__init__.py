"""Readers and writers of files; every error message names the file, the place in it, and a remedy.

- `files`: text, TOML and atomic writing; error sentences for all readers
- `films`: frames of films, and films of frames
- `images`: EXR, PNG, photographs, masks, mattes
- `lens`: lens files and importers, the glass catalogue, short texts of coatings and plates
- `project`: project, scene and look files, short texts of spectra
- `tracks`: places of lights in a picture over time, from tracking and 3D programs
- `measurement`: capture lists, merged runs, ghost models
- `render_state`: state and cache files of interrupted or repeated runs
"""
