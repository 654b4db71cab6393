"""Documents that name files."""

import struct

from PIL import Image

MESH = '<mesh name="m" file="{}"/>'


TEXTURE = '<texture name="t" type="2d" file="{}"/>'


CUBE = '<texture name="t" type="cube" fileright="{}" fileleft="{}"/>'


HFIELD = '<hfield name="f" size="1 1 1 1" file="{}"/>'


SKIN = '<deformable><skin name="s" file="{}"/></deformable>'


FLEX = '<body name="cloth"><flexcomp name="c" type="mesh" dim="2" rigid="true" file="{}"/></body>'


CHILD = """<mujoco model="child">{}<asset><mesh name="m" file="{}"/></asset>
<worldbody><body name="b"><geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""


OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def document(head="", asset="", world="", more=""):
    """A cart-pole that names files."""
    return f"""<mujoco model="t">{head}
  <option timestep="0.02" gravity="0 0 -9.8"><flag contact="disable"/></option>
  <asset>{asset}</asset>
  <worldbody>{world}<body name="cart">
    <joint name="s" type="slide" axis="1 0 0"/><geom type="box" size=".2 .1 .1" mass="1"/>
    <body name="pole"><joint name="h" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 1" size=".03" mass=".1"/></body>
  </body></worldbody>
  <actuator><motor joint="s" gear="10" ctrlrange="-1 1" ctrllimited="true"/></actuator>{more}
</mujoco>"""


def included(content):
    return f"<mujocoinclude>{content}</mujocoinclude>"


def skin_bytes():
    """A triangle that follows the body named cart."""
    whole = struct.pack("4i", 3, 0, 1, 1) + struct.pack("9f", *range(9))
    whole += struct.pack("3i", 0, 1, 2) + b"cart".ljust(40, b"\0")
    whole += struct.pack("7f", 0, 0, 0, 1, 0, 0, 0) + struct.pack("i", 3)
    return whole + struct.pack("3i", 0, 1, 2) + struct.pack("3f", 1, 1, 1)


def write(folder, files):
    """Write documents, given as text, and other files, named alone."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if text:
            path.write_text(text, encoding="utf-8")
        elif path.suffix == ".png":
            Image.effect_noise((8, 8), 50).convert("RGB").save(path)
        else:
            path.write_bytes(skin_bytes() if path.suffix == ".skn" else OBJ)
    return folder / "main.xml"


def compiler(attributes):
    return f"<compiler {attributes}/>"
