"""Studies: trainings by the thousand, as one file describes them, and what they say together."""
