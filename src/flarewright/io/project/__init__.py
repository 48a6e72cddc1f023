"""Project, scene, look and data set files, and the text forms of spectra.

- `camera_list`: `camera_formats`, `camera_format`, active areas of cameras by name
- `file_of_kind`: `read_file_of_kind`, the TOML of a project, a scene or a specification; `example_file`
- `dataset_file`: `read_dataset_spec`, distributions of training pairs
- `look_file`: `read_look`, `look_text`, `shipped_looks`
- `named_files`: `picture_files`, the pictures that a project or a lens names
- `project_file`: `read_project`, `project_from_data`, `project_json_schema`
- `project_text`: `project_text`, projects as TOML
- `scene_file`: `read_scene`, `scene_from_data`, `scene_json_schema`
- `spectrum_text`: `parse_spectrum`, `spectrum_text`
"""
