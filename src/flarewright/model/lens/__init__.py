"""Records of a lens: prescription, glasses, coatings, iris, and the parts added to it.

`flarewright.model` re-exports the public records.

- `coating`: `Coating` and its types `Bare`, `QuarterWave`, `Film`, `Stack`, `Standard`
- `figure`: `Figure`, the figure error of a surface
- `glass`: `Medium` and its `Dispersion`
- `grating`: `SensorGrating`, the pixel structure of a sensor
- `imperfection`: `Imperfection`, manufacturing tolerances
- `iris`: `Iris`, the blades
- `plate`: `Plate`, a filter or cover glass
- `prescription`: `Lens` with its `Surface`, `Stop`, `Element` and `Position` records
- `raw_lens`: `RawLens`, `RawSequence`, `LensReading`, results of importers
- `scatter`: `Scatter`, surface scatter
"""
