"""Damaged MJCF files are loaded and stepped, or refused with one clear line: no third outcome.

Each batch runs in a process of its own (this file as a script), since what is looked for is an
MJCF that ends the process, hangs or eats the memory.
"""

import faulthandler
import functools
import importlib.util
import json
import random
import re
import signal
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux processes")

SECONDS_PER_FILE = 20
ADDRESSES = 4 * 2**30
"""Bytes that a process may ask for."""
MEGABYTES = 1500
"""That it may use."""
BATCH = 100
STEPS = 50

FOREIGN = (
    ("dm_control", "suite/cartpole.xml"),
    ("gymnasium", "envs/mujoco/assets/inverted_pendulum.xml"),
)


@functools.cache
def bases() -> list[str]:
    """Whole documents to be damaged."""
    from mjcartpole.physics.load import load_model

    tests = Path(__file__).parents[1]
    files = [*(tests / "physics" / "models").glob("*.xml"), *(tests / "models").glob("*.xml")]
    sources = ["cartpole", "twopoles", *sorted(files)]
    for package, file in FOREIGN:
        spec = importlib.util.find_spec(package)
        sources += [Path(spec.origin).parent / file] if spec is not None else []
    return [load_model(source).xml for source in sources]


ABSURD = (
    "1e30", "-1e30", "1e9", "1e-9", "1e-30", "-1", "0", "nan", "inf", "-inf", "", "word", "2",
    "0.5", "100000", "2147483647", "-2147483648", "9999999999", "1000000", "true", "false", "1 2 3",
    "0 0 0", "nan nan nan", "0 0 0 0 0 0", "1e200 0 0", "1e400", "0x10", "ä", "\u2028", "a" * 5000,
    "10G", "1T", "mesh", "ball", "free", "slide", "hinge", "RK4", "implicit", "user", "muscle",
    "integrator", "affine", "plane", "hfield", "sdf", "PGS", "CG", "disable", "enable", "elliptic",
    "track", "targetbody", "-1 1", "1 -1", "nan 1", "-inf inf", "0.01 0.5", "../..", "/", "cart",
)  # fmt: skip

NUMBERS = (
    "1e30", "-1e30", "1e15", "1e9", "1e-9", "1e-30", "-1", "0", "1", "nan", "inf", "-inf", "0.001",
    "100000", "2147483647", "1000", "30", "-0.3", "2", "3.14", "1e200", "1e308",
)  # fmt: skip

SETTINGS = (
    ("option", "timestep"), ("option", "gravity"), ("option", "iterations"), ("option", "density"),
    ("option", "viscosity"), ("option", "wind"), ("option", "impratio"), ("option", "magnetic"),
    ("option", "tolerance"), ("option", "ls_iterations"), ("option", "noslip_iterations"),
    ("option", "solver"), ("option", "jacobian"), ("option", "cone"), ("option", "ccd_iterations"),
    ("option", "sdf_initpoints"), ("option", "actuatorgroupdisable"), ("option", "o_margin"),
    ("size", "memory"), ("size", "njmax"), ("size", "nconmax"), ("size", "nstack"),
    ("size", "nuserdata"), ("size", "nkey"), ("size", "nuser_body"), ("size", "nuser_jnt"),
    ("size", "nuser_geom"), ("size", "nuser_actuator"), ("size", "nuser_sensor"),
    ("compiler", "boundmass"), ("compiler", "boundinertia"), ("compiler", "settotalmass"),
    ("compiler", "angle"), ("compiler", "coordinate"), ("compiler", "inertiafromgeom"),
    ("compiler", "eulerseq"), ("compiler", "meshdir"), ("compiler", "balanceinertia"),
    ("compiler", "fusestatic"), ("compiler", "discardvisual"), ("compiler", "inertiagrouprange"),
    ("statistic", "extent"), ("statistic", "meansize"), ("statistic", "center"),
    ("statistic", "meaninertia"), ("joint", "range"), ("joint", "limited"), ("joint", "ref"),
    ("joint", "springref"), ("joint", "stiffness"), ("joint", "damping"), ("joint", "armature"),
    ("joint", "frictionloss"), ("joint", "axis"), ("joint", "pos"), ("joint", "margin"),
    ("joint", "solreflimit"), ("joint", "solimplimit"), ("joint", "actuatorfrcrange"),
    ("joint", "springdamper"), ("joint", "group"), ("joint", "user"), ("joint", "actuatorgravcomp"),
    ("geom", "size"), ("geom", "mass"), ("geom", "density"), ("geom", "type"), ("geom", "contype"),
    ("geom", "condim"), ("geom", "friction"), ("geom", "margin"), ("geom", "gap"), ("geom", "quat"),
    ("geom", "solref"), ("geom", "solimp"), ("geom", "fromto"), ("geom", "pos"), ("geom", "mesh"),
    ("geom", "fluidshape"), ("geom", "group"), ("geom", "priority"), ("geom", "conaffinity"),
    ("body", "pos"), ("body", "quat"), ("body", "euler"), ("body", "gravcomp"), ("body", "mocap"),
    ("body", "sleep"), ("body", "childclass"), ("inertial", "mass"), ("inertial", "diaginertia"),
    ("inertial", "pos"), ("inertial", "fullinertia"), ("motor", "ctrlrange"), ("motor", "gear"),
    ("motor", "forcerange"), ("motor", "joint"), ("motor", "site"), ("motor", "tendon"),
    ("motor", "group"), ("motor", "delay"), ("motor", "nsample"), ("motor", "lengthrange"),
    ("motor", "cranklength"), ("motor", "damping"), ("motor", "armature"), ("texture", "width"),
    ("texture", "height"), ("texture", "file"), ("texture", "nchannel"), ("texture", "gridsize"),
    ("camera", "fovy"), ("camera", "resolution"), ("camera", "mode"), ("camera", "target"),
    ("light", "mode"), ("global", "offwidth"), ("quality", "shadowsize"), ("map", "znear"),
)  # fmt: skip

SNIPPETS = (
    ("worldbody", '<replicate count="100000" offset="1 0 0"><geom size="1"/></replicate>'),
    ("worldbody", '<replicate count="1000000000"><body/></replicate>'),
    ("worldbody", '<replicate count="999"><replicate count="999"><site/></replicate></replicate>'),
    ("body", '<replicate count="3" euler="0 0 1"><geom size=".01" mass=".01"/></replicate>'),
    ("body", '<replicate count="20000"><geom size=".01" mass=".01"/></replicate>'),
    ("worldbody", '<composite type="cable" count="100000 1 1"><geom size="1"/></composite>'),
    ("worldbody", '<composite type="cable" count="3 1 1" curve="s"><geom size="1"/></composite>'),
    ("worldbody", '<flexcomp name="f" type="grid" count="300 300 300" dim="3" mass="1"/>'),
    ("worldbody", '<flexcomp name="f" type="grid" count="3 3 1" dim="2" mass="1" radius=".01"/>'),
    ("asset", '<texture name="big" type="2d" builtin="flat" width="100000" height="100000"/>'),
    ("asset", '<texture name="b" type="skybox" builtin="flat" width="30000" height="30000"/>'),
    ("asset", '<texture name="neg" type="2d" builtin="flat" width="-5" height="100"/>'),
    ("asset", '<hfield name="h" nrow="100000" ncol="100000" size="1 1 1 1"/>'),
    ("asset", '<mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>'),
    ("asset", '<mesh name="m" vertex="0 0 0 0 0 0 0 0 0 0 0 0"/>'),
    ("asset", '<mesh name="m" vertex="nan 0 0 1 0 0 0 1 0 0 0 1"/>'),
    ("asset", '<mesh name="m" builtin="sphere" params="10"/>'),
    ("asset", '<mesh name="m" file="nowhere.stl"/>'),
    ("asset", '<mesh name="m" builtin="supersphere" params="5000 1 1"/>'),
    ("asset", '<texture name="f" type="2d" file="nowhere.png"/>'),
    ("asset", '<model name="m" file="nowhere.xml"/>'),
    ("mujoco", '<include file="nowhere.xml"/>'),
    ("mujoco", '<include file="/"/>'),
    ("mujoco", '<extension><plugin plugin="mujoco.pid"/></extension>'),
    ("mujoco", '<extension><plugin plugin="mujoco.elasticity.cable"/></extension>'),
    ("mujoco", '<keyframe><key qpos="nan 0" qvel="0 0"/></keyframe>'),
    ("mujoco", '<keyframe><key qpos="1 2 3 4 5"/></keyframe>'),
    ("mujoco", '<custom><numeric name="n" size="1000000000"/></custom>'),
    ("mujoco", '<custom><numeric name="n" size="-1" data="1"/></custom>'),
    ("mujoco", '<equality><joint joint1="slider" joint2="hinge"/></equality>'),
    ("mujoco", '<equality><joint joint1="hinge" polycoef="nan 0 0 0 0"/></equality>'),
    ("mujoco", '<equality><weld body1="cart" body2="pole"/></equality>'),
    ("mujoco", '<equality><connect body1="cart" anchor="1e30 0 0"/></equality>'),
    ("mujoco", '<contact><pair geom1="cart" geom2="pole"/></contact>'),
    ("mujoco", '<contact><exclude body1="cart" body2="pole"/></contact>'),
    ("mujoco", '<tendon><fixed name="t"><joint joint="hinge" coef="1e30"/></fixed></tendon>'),
    ("mujoco", '<tendon><spatial name="t" stiffness="1e30"><site site="s"/></spatial></tendon>'),
    ("mujoco", '<sensor><jointpos joint="hinge" noise="nan"/></sensor>'),
    ("mujoco", '<sensor><user dim="100000000"/></sensor>'),
    ("mujoco", '<sensor><rangefinder site="s"/><touch site="s"/></sensor>'),
    ("mujoco", '<sensor><jointpos joint="hinge" nsample="100000000" delay="1"/></sensor>'),
    ("mujoco", '<actuator><muscle joint="slider"/></actuator>'),
    ("mujoco", '<actuator><adhesion body="cart" ctrlrange="0 1"/></actuator>'),
    ("mujoco", '<actuator><cylinder joint="slider"/></actuator>'),
    ("mujoco", '<size memory="1T"/>'),
    ("mujoco", '<size memory="1"/>'),
    ("mujoco", '<size memory="1M" nuserdata="2000000000"/>'),
    ("mujoco", '<size nuser_body="100000000"/>'),
    ("mujoco", '<size njmax="2000000000" nconmax="2000000000"/>'),
    ("mujoco", '<size nkey="100000000"/>'),
    ("mujoco", '<option timestep="1e-9"/>'),
    ("mujoco", '<option iterations="2147483647" tolerance="0"/>'),
    ("mujoco", '<option><flag override="enable" fwdinv="enable" energy="enable"/></option>'),
    ("mujoco", '<default><default class="x"><joint range="nan nan"/></default></default>'),
    ("body", '<body><freejoint/><geom size="1"/></body>'),
    ("body", '<body><joint type="ball"/><geom size="1"/></body>'),
    ("body", '<body mocap="true"/>'),
    ("body", '<site name="s" size="nan"/>'),
    ("body", '<geom type="mesh" mesh="m"/>'),
    ("body", '<geom type="sdf" mesh="m"><plugin plugin="mujoco.sdf.torus"/></geom>'),
    ("body", '<attach model="m" body="b" prefix="p"/>'),
    ("body", '<frame euler="0 90 0"><geom size="0.01" mass="1e-20"/></frame>'),
    ("body", '<camera name="c" resolution="100000 100000"/>'),
    ("body", '<plugin plugin="mujoco.elasticity.cable"/>'),
)  # fmt: skip


def mutated(rng: random.Random) -> str:
    """A cart-pole's document with one to four damages."""
    root = ElementTree.fromstring(rng.choice(bases()))
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        rng.choice(DAMAGES)(rng, root)
    text = ElementTree.tostring(root, encoding="unicode")
    return _torn(rng, text) if rng.random() < 0.04 else text


def _elements(root, with_attributes=False):
    return [item for item in root.iter() if item.attrib or not with_attributes]


def _parents(root):
    return [(parent, child) for parent in root.iter() for child in parent]


def _delete_attribute(rng, root):
    element = rng.choice(_elements(root, with_attributes=True))
    del element.attrib[rng.choice(sorted(element.attrib))]


def _change_attribute(rng, root):
    element = rng.choice(_elements(root, with_attributes=True))
    element.set(rng.choice(sorted(element.attrib)), rng.choice(ABSURD))


def _change_number(rng, root):
    """One number, or all of them by a factor; as many as before."""
    places = [
        (element, name)
        for element in root.iter()
        for name, value in element.attrib.items()
        if re.fullmatch(r"[-+.\deE\s]+", value)
    ]
    element, name = rng.choice(places)
    numbers = element.get(name).split()
    if rng.random() < 0.4:
        factor = rng.choice((-1, 0, 1e-6, 1e-3, 0.5, 1.1, 30, 1e4, 1e12))
        numbers = [repr(float(number) * factor) for number in numbers]
    else:
        numbers[rng.randrange(len(numbers))] = rng.choice(NUMBERS)
    element.set(name, " ".join(numbers))


def _swap_attributes(rng, root):
    one, other = (rng.choice(_elements(root, with_attributes=True)) for _ in range(2))
    name, its_name = rng.choice(sorted(one.attrib)), rng.choice(sorted(other.attrib))
    value, its_value = one.get(name), other.get(its_name)
    one.set(name, its_value)
    other.set(its_name, value)


def _set_something(rng, root):
    tag, name = rng.choice(SETTINGS)
    found = list(root.iter(tag))
    if not found and tag in {"option", "size", "compiler", "statistic"}:
        found = [ElementTree.SubElement(root, tag)]
    if not found:
        return
    count = rng.choice((1, 1, 1, 2, 3))
    numbers = " ".join(rng.choice(NUMBERS) for _ in range(count))
    rng.choice(found).set(name, rng.choice(ABSURD) if rng.random() < 0.2 else numbers)


def _delete_element(rng, root):
    parent, child = rng.choice(_parents(root))
    parent.remove(child)


def _duplicate_element(rng, root):
    parent, child = rng.choice(_parents(root))
    copy = ElementTree.fromstring(ElementTree.tostring(child))
    if rng.random() < 0.5:
        for element in copy.iter():
            element.attrib.pop("name", None)
    parent.append(copy)


def _move_element(rng, root):
    parent, child = rng.choice(_parents(root))
    parent.remove(child)
    others = [item for item in root.iter() if item.tag == parent.tag]
    rng.choice(others if others and rng.random() < 0.8 else _elements(root)).append(child)


def _rename_element(rng, root):
    element = rng.choice(_elements(root))
    element.tag = rng.choice([item.tag for item in root.iter()])


def _insert_snippet(rng, root):
    tag, text = rng.choice(SNIPPETS)
    found = list(root.iter(tag)) or [root]
    rng.choice(found).append(ElementTree.fromstring(text))


DAMAGES = (
    _delete_attribute, _delete_attribute, _change_attribute, _change_number, _change_number,
    _change_number, _change_number, _swap_attributes, _set_something, _set_something,
    _set_something, _delete_element, _delete_element, _duplicate_element, _duplicate_element,
    _move_element, _rename_element, _insert_snippet, _insert_snippet,
)  # fmt: skip


def _torn(rng, text):
    """A file that was cut off, or in which some characters are others."""
    if rng.random() < 0.3:
        return text[: rng.randrange(1, len(text))]
    letters = list(text)
    for _ in range(rng.randrange(1, 6)):
        letters[rng.randrange(1, len(letters))] = chr(rng.choice((0, 10, 34, 38, 60, 62, 65, 955)))
    return "".join(letters)


def outcome(text: str, path: Path, rng: random.Random) -> str:
    """What happens to a document: a word or two if it is as it should be, or what is wrong."""
    import numpy as np

    from mjcartpole.envs.cartpole import CartPoleEnv
    from mjcartpole.errors import MjCartPoleError

    path.write_text(text, encoding="utf-8")
    source = path if rng.random() < 0.5 else text
    try:
        env = CartPoleEnv(model=source, integrator=rng.choice(("gym", "mujoco")))
        env.reset(seed=rng.randrange(1000))
        for _ in range(STEPS):
            observation, reward, _, _, _ = env.step(rng.randrange(2))
            # A huge but finite velocity is infinite as a float32.
            if not np.isfinite(observation).all() or reward not in {0.0, 1.0}:
                return f"WRONG observation {observation}, reward {reward}"
    except MjCartPoleError as error:
        message = str(error)
        clear = len(message.splitlines()) == 1 and 20 < len(message) < 1000
        fine = clear and "alloc" not in message
        return f"{'' if fine else 'WRONG '}{type(error).__name__}: {message}"
    except Exception as error:
        return f"WRONG {type(error).__name__}: {error}"
    return "steps"


def run_batch(first: int, last: int, folder: Path) -> None:
    """Say when a file begins and when it ends; the process may die between."""
    import resource

    from mjcartpole.physics.simulation import silence_mujoco

    faulthandler.enable()
    warnings.simplefilter("ignore")  # of steps after an episode's end
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    silence_mujoco()
    for number in range(first, last):
        rng = random.Random(number)
        text = mutated(rng)
        _say(begin=number)
        signal.alarm(SECONDS_PER_FILE)
        result = outcome(text, folder / "mutated.xml", rng)
        signal.alarm(0)
        megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
        _say(end=number, result=result if megabytes < MEGABYTES else f"WRONG {megabytes} MB")


def _say(**words) -> None:
    sys.stdout.write(json.dumps(words) + "\n")
    sys.stdout.flush()


def run_many(first: int, last: int) -> dict[int, str]:
    """Results by number; where a file ends the process, another one goes on behind it."""
    results: dict[int, str] = {}
    while first < last:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, __file__, str(first), str(min(first + BATCH, last)), folder]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        said = [json.loads(line) for line in done.stdout.splitlines()]
        assert said, done.stderr
        results |= {words["end"]: words["result"] for words in said if "end" in words}
        last_begun = max(words["begin"] for words in said if "begin" in words)
        ended = f"WRONG: process ended with {done.returncode}: {done.stderr[:500]}"
        results.setdefault(last_begun, ended)
        first = last_begun + 1
    return results


def check(results: dict[int, str]) -> None:
    wrong = {number: result for number, result in results.items() if result.startswith("WRONG")}
    assert not wrong
    kinds = Counter(result.split(":")[0] for result in results.values())
    # The damages are such that all outcomes are seen.
    assert kinds["steps"] > len(results) / 6
    assert kinds["NotACartPoleError"] > len(results) / 50
    assert kinds["ModelError"] > len(results) / 50


@pytest.mark.slow
def test_60_mutated_files():
    results = run_many(0, 60)
    assert sorted(results) == list(range(60))
    check(results)


@pytest.mark.slow
def test_2000_mutated_files():
    results = run_many(1000, 3000)
    assert sorted(results) == list(range(1000, 3000))
    check(results)


if __name__ == "__main__":
    run_batch(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
