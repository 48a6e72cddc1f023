"""Design: a lens for the flare that is wanted (Van Acoleyen 2025, and beyond)."""
