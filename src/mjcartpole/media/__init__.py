"""Pictures of a cart-pole: frames by OpenGL or without it, and videos."""

import mjcartpole.physics  # noqa: F401 - it knows how to import MuJoCo where there is no OpenGL
