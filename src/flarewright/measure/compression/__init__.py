"""Reduces a fitted model to the parameters that the frames support.

Cross-validation over left-out constellations drops parameters; curves describe what the remaining ones miss.

- `order_selection`: selects the needed parameters of a ghost (`parabola`, `needed_numbers`)
- `prune`: compacts a model: fewer parameters, curves, rounding (`compact_model`, `count_parameters`)
- `settings`: settings of the compression (`CompressionSettings`)
"""
