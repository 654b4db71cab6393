"""From an MJCF file to one control step."""
