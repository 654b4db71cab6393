"""Disturbances that are to be others than a run's."""

import dataclasses

import pytest

from mjcartpole.disturbances.changes import DisturbanceChanges
from mjcartpole.disturbances.disturbances import NONE, Disturbances, WorldDisturbances
from mjcartpole.errors import ConfigError

OWN = Disturbances(vary="force=8:10", pool=3, delay=2, noise=0.1, observe_actions=1)


def test_what_is_left_out_stays_as_it_is() -> None:
    assert DisturbanceChanges().added_to(OWN) == OWN
    assert DisturbanceChanges().added_to(NONE) == NONE
    both = DisturbanceChanges(lag=0.1, push=("1@2s",)).added_to(OWN)
    assert both == dataclasses.replace(OWN, lag=0.1, push=("1@2s",))


def test_what_is_given_takes_the_place_of_the_runs_own_zeros_included() -> None:
    assert DisturbanceChanges(delay=0, noise=(0.0,)).added_to(OWN) == Disturbances(
        vary="force=8:10", pool=3, observe_actions=1
    )


def test_every_field_has_a_value_for_not_given() -> None:
    assert DisturbanceChanges().additions == {}
    for field in dataclasses.fields(WorldDisturbances):
        assert getattr(DisturbanceChanges(), field.name) in (None, ())


def test_what_makes_no_sense_is_refused_as_anywhere() -> None:
    with pytest.raises(ConfigError, match="hold must be from 0 to 1"):
        DisturbanceChanges(hold=1.5).added_to(NONE)
