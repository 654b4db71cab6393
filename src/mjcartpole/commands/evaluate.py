"""`mjcartpole evaluate`."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from mjcartpole.commands.options import Command, Included, UsageError
from mjcartpole.commands.printing import counted, print_evaluation, print_seeds, with_added
from mjcartpole.learning.evaluation import EPISODES
from mjcartpole.studies.eval_target import EvalTarget

if TYPE_CHECKING:
    from mjcartpole.studies.policy_setup import PolicySetup
    from mjcartpole.studies.seeds import ManyResult


@dataclass(frozen=True)
class Evaluate(Command):
    """Play greedy episodes from fresh starting states, and count."""

    source: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY")] = (
        None
    )
    """A run folder, one of many --seeds, or a policy file."""
    policy: str | None = None
    """A controller instead, made for the model that it plays: lqr, energy, random, constant."""
    target: Included[EvalTarget] = field(default_factory=EvalTarget)
    episodes: int = EPISODES
    """How many."""
    json: bool = False
    """Print JSON."""

    def run(self) -> int:
        """Play, and print the figures; of many seeds, of each."""
        from mjcartpole.commands.policies import set_up, set_up_controller
        from mjcartpole.studies.multi_seed_runs import is_seeds

        if self.source and not self.policy:
            if is_seeds(self.source):
                return self._run_seeds(self.source)
            setup = set_up(self.source, self.target)
        elif self.policy and not self.source:
            setup = set_up_controller(self.policy, self.target)
        else:
            raise UsageError(
                "evaluate needs a RUN-OR-POLICY, or --policy and the name of a controller; "
                "see mjcartpole evaluate --help"
            )
        result = setup.evaluate(self.episodes)
        if self.json:
            print(json.dumps({**self._head(setup), **result.summary()}))
        else:
            print_evaluation(result, self._chosen_model(setup))
        return 0

    def _run_seeds(self, source: Path) -> int:
        from mjcartpole.commands.policies import learned_seeds, set_up_all
        from mjcartpole.learning.documents import read_config
        from mjcartpole.studies.seeds import ManyResult, SeedResult

        learned = learned_seeds(source)
        setups = set_up_all(learned.values(), self.target)
        pairs = zip(learned, setups, strict=True)
        found = [SeedResult(seed, setup.evaluate(self.episodes)) for seed, setup in pairs]
        config = read_config(next(iter(learned.values())))[2]
        self._print_many(ManyResult(config, tuple(found)), setups[0])
        return 0

    def _print_many(self, many: "ManyResult", first: "PolicySetup") -> None:
        if not self.json:
            print(
                f"\ngreedy evaluation on {first.backend}{self._chosen_model(first)}"
                f"{with_added(first.disturbances)}: {counted(len(many.seeds), 'seed')}, "
                f"{counted(self.episodes, 'episode')} each, seed {first.seed}\n"
            )
            print_seeds(many)
            return
        each = [
            {"train_seed": one.seed, **one.evaluation.summary()}
            for one in many.seeds
            if one.evaluation
        ]
        aggregate = many.aggregate()
        figures = aggregate.summary() if aggregate else None
        print(json.dumps({**self._head(first), "seeds": each, "greedy_return": figures}))

    def _head(self, setup: "PolicySetup") -> dict[str, str]:
        return {"policy": str(self.source or self.policy), "model": _model_name(setup)}

    def _chosen_model(self, setup: "PolicySetup") -> str:
        """Return what a headline says of a model that is not the policy's own."""
        return f", {_model_name(setup)}" if self.target.model or self.target.set else ""


def _model_name(setup: "PolicySetup") -> str:
    return setup.model if isinstance(setup.model, str) else setup.cartpole.name
