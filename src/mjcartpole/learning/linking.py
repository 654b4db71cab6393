"""What compiled code is made with: MuJoCo's library, arrays at addresses, functions by physics."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeAlias, TypeVar, cast

import llvmlite.binding
from numba import types
from numba.extending import intrinsic, overload, register_jitable

F = TypeVar("F", bound=Callable[..., Any])

AnyPhysics: TypeAlias = Any
"""One kind of physics, where Numba is to see one name for all."""


INSIDE: Final[Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Options of functions that only compiled code calls: no way from Python into each is compiled, and
Numba takes what it has for one caller for all, where their options are the same."""

INLINE: Final[Any] = {**INSIDE, "forceinline": True}
"""The same of functions that a step is made of: a call of one would put its numbers into memory."""


def link(library: Path | None) -> str:
    """Make MuJoCo's functions known to the compiler; returns why that failed, or nothing."""
    if library is None:
        return "libmujoco was not found in the mujoco package"
    try:
        llvmlite.binding.load_library_permanently(str(library))
    except RuntimeError as error:
        return f"libmujoco cannot be linked: {error}"
    if llvmlite.binding.address_of_symbol("mj_step") is None:
        return f"'{library}' has no mj_step"
    return ""


def compiled(function: F) -> F:
    """Let compiled code call a function; for Python it stays what it is."""
    return register_jitable(**INSIDE)(function)


def inlined(function: F) -> F:
    """Do the same, and copy it to wherever it is called."""
    return register_jitable(**INLINE)(function)


def _array_at(kind: types.Type) -> Callable[[int], Any]:
    """Return what makes an array of an address in compiled code."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    pointer: Any = types.CPointer(kind)  # type: ignore[no-untyped-call]

    @intrinsic
    def array_at(context: Any, address: Any) -> Any:
        return pointer(address), generate

    return cast(Callable[[int], Any], array_at)


floats, ints = _array_at(types.float64), _array_at(types.int64)


def for_each(mujoco: F, gym: F, **others: Callable[..., Any]) -> Callable[[F], F]:
    """Let Numba take one function of these for a stub, by the physics: its first argument.

    `others` go by the names of their kinds; `gym` is for all kinds without one of their own.
    """
    functions: dict[str, Any] = {"MujocoPhysics": mujoco, **others}

    def register(stub: F) -> F:
        @overload(stub, strict=False, jit_options=INLINE)
        def choose(physics: AnyPhysics, *others: object) -> Any:
            return functions.get(physics.instance_class.__name__, gym)

        return stub

    return register
