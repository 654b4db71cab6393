"""The faces that other libraries use."""
