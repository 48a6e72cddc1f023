"""Readers of tracks: places of lights in a picture over time, from the files of tracking and 3D programs.

- `track`: `Track`, `TrackFile`: what every reader returns
- `numbers`: numbers of text files, and the limits on their count
- `read_tracks`: `read_tracks` finds out which program wrote a file, and reads it
- `table`: comma-separated tables
- `nuke`: Nuke's Tracker nodes, animated positions and columns of numbers
- `after_effects`: keyframe data from the clipboard of After Effects
- `syntheyes`: 2D tracker paths of SynthEyes
- `equalizer`: 2D tracks of 3DEqualizer
- `scene`: `tracks_of_scene`, the lights of a 3D scene as its camera sees them
- `scene_json`: scenes of the Blender add-on
- `usd_stage`: USD stages
"""
