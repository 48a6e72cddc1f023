"""The proof of the measurement: captures of lenses that the fitter has not seen, judged by the noise-free truth."""
