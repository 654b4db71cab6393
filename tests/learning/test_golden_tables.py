"""Tables that every later state must learn again, bit for bit: SHA-256 of what 0.1.0 learned."""

import hashlib

import numpy.typing as npt
import pytest

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import train
from nightly import few

FORMER = {"episodes": 1_500, "td_lambda": 0.9, "alpha_final": 0.01, "decay": 0.5, "mirror": False}
"""What `tuned` was in 0.1.0."""

ONE_STEP = {"td_lambda": None}

FORMER_TWO_POLES = {"bins": (3, 1, 8, 8, 8, 8), "alpha": 0.1, "tilings": 1, "mirror": False}
"""What `two-poles` was; beside its episodes."""

PRESETS = [
    (
        TrainConfig.preset("tuned", **FORMER),
        "0a14bbeac28b724056643ef89e6dfe5f170b35340ae1918f57b19c49b7ed0aa8",
        "86d6c26c98ea4397fa2452431bcdff5a4c377bcdafecc2a8a48ff9d5db96b7fd",
    ),
    (
        TrainConfig.preset("tuned", backend="gym", **FORMER),
        "0e608f16050e0a6ea3f7eccd3ccc8d8773460bc5dc0fc45d18967d95d2572d7b",
        "e0453f81252f8838894e96c17fca3bf6565837930f7db46bea4bb743da2b0dc4",
    ),
    (
        TrainConfig.preset("tuned", integrator="mujoco", seed=7, **FORMER),
        "20a1089585f282b6d56cf6b424cedb7c9455395c493e16cc6131cbc078e4b881",
        "fb1e1738f2b804879a922473f2d2b102c7a75ef072446b0e7882825370e95cef",
    ),
    (
        TrainConfig.preset("tuned", **FORMER | ONE_STEP, seed=3, ties="random"),
        "bb4e7e8850167ed80cf9e3d7af77c636a1257d09ed59f72607bbe663c0bd191a",
        "1d4c6c0a4cb513efd7f04cd822112a3dd075f26d0f1ca28ad57d5641a34ae01c",
    ),
    (
        TrainConfig.preset(
            "tuned",
            **FORMER | ONE_STEP,
            backend="gym",
            seed=3,
            ties="random",
            learn_last_step=False,
        ),
        "c8f08b4653272a7be4815a23bc5bcb0678dcca4f7a5376c909924fff3d53416e",
        "ba352596ba442501e463af4a207b6e56acd34369ebd003672606b90ed0155acd",
    ),
    (
        TrainConfig.preset("article", backend="gym"),
        "67ee0639500dbff631e0b5927fc40a5953aaa2cee310849fa4c501450d187ccf",
        "e8a336ac71b3e4ed387f172963148d8a5734a96f919a2056045b261cb1cf83be",
    ),
    (
        TrainConfig.preset("article-terminal", backend="gym"),
        "51e0f3df3f74aeda1b2e1c2ceeca9bea37d640d46d5b02d97b679f9148c0421e",
        "e8c1c934ab156b9e080b030d9f0b184aab49e93cc46dbbeb58637085c08b43b0",
    ),
    (
        TrainConfig.preset("two-poles", episodes=1_000, **FORMER_TWO_POLES),
        "80588b50a22ceec84d597e568da44ba22af26f3d26030d86a61be1bbf850dcb2",
        "0b542e05089a8ffbaf8011a7ff92b762a4bf5575ef216b053db034d92a4da246",
    ),
]
LONG = [
    (
        TrainConfig.preset("article"),
        "5c88f66b0a9ac18c72c1cad794569647a41bc34a58f5e9cf888f5512ba87aa2a",
        "3df33dac9517be81bb3b4a8f1ad8e1213ef40afe1cede9daf610f53aa55913f2",
    ),
    (
        TrainConfig.preset("article-terminal"),
        "103816c061ff93224c0f4f64954262693832a66734a077610eb9b7bcd391c64e",
        "43cd7d372ef33dbf607770ca3318ca557f9b0665c10d03ef75e33cda62a8f06f",
    ),
    (
        TrainConfig.preset("two-poles", episodes=30_000, **FORMER_TWO_POLES),
        "a7eba4615b6856f81507c1e8798106ad2993e01af86026a30afb5762216fc296",
        "6bc9a0773b3899367860dc1d2598329b9385b4860c47a6fadd8524fd0cff5417",
    ),
]


def sha256(values: npt.NDArray) -> str:
    return hashlib.sha256(values.tobytes()).hexdigest()


@pytest.mark.parametrize(
    ("config", "table", "returns"),
    few([*PRESETS, *LONG], *PRESETS[:2], *PRESETS[4:]),
    ids=lambda value: repr(value) if isinstance(value, TrainConfig) else "",
)
def test_a_table_is_the_one_that_was_learned_before(config, table, returns):
    result = train(config)
    assert sha256(result.q_table) == table
    assert sha256(result.returns) == returns
