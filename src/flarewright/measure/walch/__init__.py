"""Walch's method (2017, chapters 7 and 8), as a reference for comparisons.

Each ghost is a Bezier primitive, fitted frame by frame by online gradient descent; its parameters become polynomials.

- `per_frame_fit`: `fit_as_walch` fits the ghosts of a run and returns a model of Bezier ghosts
- `gradient_descent`: `descend_gradient` fits one ghost in one image
- `polynomials`: `fit_polynomial` fits a polynomial whose order is chosen by leave-one-out
- `settings`: settings of Walch's method (`WalchSettings`)
"""
