"""One HTML file in which a browser runs MuJoCo with a run's model and table."""
