"""Text and state files: reading and atomic writing.

Readers call `text_file.read_toml` or `text_file.read_text` and turn validation errors into sentences with
`flarewright.sentences`. Writers call `atomic_write.write_atomically`.

- `atomic_write`: `write_atomically`, complete files or none; `delete_written`, `make_folder`
- `door`: `outside`, the one way to a file of the user; `sentences_for`, `refuse_claim`, `expanded`, `shown`
- `file_lock`: `held`, `locked`, locks between processes
- `file_kind`: `is_ghost_model_file`, `lens_key`; `refuse_other_kind`, errors for a file of another kind
- `silence_libraries`: `silenced`, suppresses the output of libraries
- `state_folder`: `state_folder`, the folder for data that outlives a run
- `tar_members`: `tar_member`, `join_parts`, tar files joined from parts
- `temporary_file`: `temporary_beside`, `remove_abandoned`, names of unfinished files and their removal after a kill
- `text_file`: `read_text`, `read_toml`, `parsed_toml`, `read_json`, `read_bytes`, `check_version`
- `toml_errors`: `toml_sentence`, explains TOML syntax errors
- `type_slips`: `record_of`, makes records without type conversion
"""
