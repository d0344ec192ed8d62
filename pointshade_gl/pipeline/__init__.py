"""From a scene to a lit picture, step by step."""
