"""Measure the flare of a real camera: from photographs of a light to a model that can be replayed."""
