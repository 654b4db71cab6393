"""What reality adds to a task."""
