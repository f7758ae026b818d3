"""Ways to ask: one axis alone, and the other way round."""

import pytest

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from webapp.session import Session


@pytest.fixture
def session() -> Session:
    return Session(load_layout(shipped_layouts()["ucat"]))


def test_an_axis_alone_and_the_other_way_round(session: Session) -> None:
    session.set_only_axis(5)
    first = session.state.target
    assert first[5] > 0 and first[:5] == (0.0,) * 5
    session.set_only_axis(5)
    assert session.state.target[5] == -first[5]
    session.set_only_axis(0)
    assert session.state.target[5] == 0.0 and session.state.target[0] > 0
    session.open_layout(load_layout(shipped_layouts()["no_yaw"]))
    with pytest.raises(FinlabError, match="acts on yaw"):
        session.set_only_axis(5)
