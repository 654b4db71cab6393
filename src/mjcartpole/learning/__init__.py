"""Tabular control: a Q-table, how it learns, and what a training leaves behind."""
