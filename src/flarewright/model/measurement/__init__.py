"""Records of a measured flare: captures, merged frames, ghost models and tracks.

- `block_values`: `Blocks`, numbers per block of a sprite
- `capture`: `Capture`, `CameraNoise`, `MergedRun`, `MergedFrame`
- `clamp_ranges`: `Reaches`, search ranges of a sprite
- `corrections`: `Corrections`, the user's changes to the ghost search
- `fine_detail`: `Detail`, detail finer than a sprite's cells
- `ghost_model`: `GhostModel` with its ghosts, `Halo` and `Star`
- `ghost_tracks`: `Tracks`, ghosts over the constellation
- `replay_camera`: `ReplayCamera`, camera and light of a replay
- `residual_motion`: `Moves`, motion of a sprite's residual light
- `sprite`: `Sprite`, residual light as small pictures
"""
