"""How much flare there will be: statistics over the constellation, contrast, and cameras and lights in a scene."""
