"""The public names of `flarewright.measure`, `design`, `predict`, `workflow`: present and documented."""

from __future__ import annotations

from importlib import import_module

import pytest

PACKAGES = ["measure", "design", "predict", "workflow"]


@pytest.mark.parametrize("name", PACKAGES)
def test_every_public_name_is_present_and_documented(name):
    package = import_module(f"flarewright.{name}")
    assert package.__all__ == sorted(package.__all__)
    assert len(package.__all__) >= 5
    for each in package.__all__:
        found = getattr(package, each)
        assert found.__doc__ if callable(found) else found
    assert set(package.__all__) <= set(dir(package))
    with pytest.raises(AttributeError, match=f"module 'flarewright.{name}' has no attribute 'nothing'"):
        package.nothing  # noqa: B018
