"""Questions asked of models and policies."""
