"""Benchmark of the measurement: synthetic captures of real lenses, compared with the noise-free truth.

- `__main__`: command line; `prove` runs all stages for one lens
- `shoot`: renders captures, the perfect merge, and the truth
- `truth`: `true_ghosts`, position, brightness and difficulty of each ghost
- `judge`: `judge` computes the scores of a model at constellations that the fit did not use
- `rolled`: the same for other light directions
- `isolated`: single ghosts, and a comparison with Walch's method
- `lateral_colour`: lateral colour of a single ghost
- `ablation`: what each layer of the residual is worth in a replay
- `optical_flow`: plain optical flow, its baseline
- `planted`: run time with ghosts of a known model
- `speed`: replay speed
- `terms`: statistics of the ghost parameters of real prescriptions
"""
