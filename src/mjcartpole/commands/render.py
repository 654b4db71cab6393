"""`mjcartpole render`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from mjcartpole.commands.options import Command, Included, OutputPath, Policies, UsageError
from mjcartpole.errors import FileError, RenderError
from mjcartpole.files import check_free, check_writable
from mjcartpole.learning.evaluation import check_count
from mjcartpole.signals import StopSignals
from mjcartpole.studies.eval_target import EvalTarget
from mjcartpole.studies.video_options import VideoOptions

if TYPE_CHECKING:
    from mjcartpole.studies.policy_setup import PolicySetup


@dataclass(frozen=True)
class Render(Command):
    """Film greedy episodes, the first that an evaluation with the same seed plays."""

    sources: Policies = ()
    """Run folders or policy files; several are shown side by side, from the same start. Of many
    --seeds in one folder, the median seed is shown."""
    policy: tuple[str, ...] = ()
    """Controllers, made for the model that they play: lqr, energy, random, constant."""
    target: Included[EvalTarget] = field(default_factory=EvalTarget)
    output: OutputPath = None
    """An .mp4, .gif or .webp, or a folder for pictures; videos/<name>.mp4 if left out, with a
    number where that is there already."""
    overwrite: bool = False
    """Replace what is there."""
    episodes: int = 1
    """How many, one after the other."""
    look: Included[VideoOptions] = field(default_factory=VideoOptions)
    sheet: bool = False
    """Write equally spaced frames as one .png instead of a video."""

    def run(self) -> int:
        """Play, and film it; all is checked before anything is played."""
        from mjcartpole.commands.films import default_path, film, write_sheet
        from mjcartpole.commands.policies import set_up_all, set_up_controller, shown
        from mjcartpole.studies.film import play

        if not (self.sources or self.policy):
            raise UsageError(
                "render needs a RUN-OR-POLICY, or several, or --policy; "
                "see mjcartpole render --help"
            )
        signals = StopSignals()
        with signals.caught():
            setups = set_up_all(map(shown, self.sources), self.target)
            setups += [set_up_controller(name, self.target) for name in self.policy]
            suffix = ".png" if self.sheet else ".mp4"
            path = self.output or default_path(setups, suffix, self.overwrite)
            self._check(setups, path)
            casts = [play(setup, self.episodes) for setup in setups]
            (write_sheet if self.sheet else film)(casts, self.look, path, signals)
        return 0

    def _check(self, setups: "list[PolicySetup]", path: Path) -> None:
        """Refuse what cannot be filmed, or be written there."""
        from mjcartpole.commands.films import instead_of
        from mjcartpole.media.video import check_path

        for setup in setups:
            self.look.check(setup.cartpole)
            check_count(self.episodes, setup.seed)
        if self.sheet:
            self._check_sheet(len(setups), path)
        suffix = ".png" if self.sheet else check_path(path)
        if suffix and path.is_dir():
            raise FileError(f"cannot write '{path}': it is a folder; give the path of a file")
        if not self.overwrite:
            check_free([path, *instead_of(path, suffix)])
        check_writable(path.parent)

    def _check_sheet(self, policies: int, path: Path) -> None:
        for count, what in ((policies, "run"), (self.episodes, "episode")):
            if count > 1:
                raise RenderError(
                    f"a contact sheet shows one {what}, not {count}; leave out --sheet"
                )
        if path.suffix.lower() != ".png":
            raise RenderError(f"a contact sheet is a .png, not '{path}'")
