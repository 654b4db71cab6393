"""Pillow, or in one line what to type where it is missing."""

from mjcartpole.errors import RenderError
from mjcartpole.packages import check_installed

check_installed("a picture", "PIL", RenderError)

from PIL import GifImagePlugin, Image, ImageDraw, ImageFont  # noqa: E402 - after the check

__all__ = ["GifImagePlugin", "Image", "ImageDraw", "ImageFont"]
