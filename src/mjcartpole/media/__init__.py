"""Pictures: frames with or without OpenGL, and frames into files."""
