"""Light: lamps, shadow maps, the light pass."""
