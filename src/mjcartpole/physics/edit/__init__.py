"""Changes of a document: by meaning, or by element, in the text itself."""
