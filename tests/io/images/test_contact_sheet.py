"""Captions of a contact sheet stay in their columns."""

import numpy as np
import pytest

from flarewright.io.images.contact_sheet import COLUMNS, Figure, sheet_picture


@pytest.mark.parametrize("width", [16, 90, 480])
def test_titles_stay_in_their_columns(width):
    def sheet(titles):
        white = np.full((30, width, 3), 255, np.uint8)
        return sheet_picture([Figure("", title, "", "", "", white) for title in titles])

    long = "0 train: flared with a name of a lens"
    whole = sheet([long] * COLUMNS)
    column = whole.shape[1] // COLUMNS
    assert column >= width
    # each column shows what it shows alone
    for k in range(COLUMNS):
        alone = sheet([long if k == j else "" for j in range(COLUMNS)])
        start = k * column
        assert (whole[:, start : start + column] == alone[:, start : start + column]).all()
        assert (alone[30:, :start] == alone[-1, 0]).all()
        assert (alone[30:, start + column :] == alone[-1, 0]).all()
    # a title of any length is cut
    assert sheet([long * 9]).shape[1] == COLUMNS * max(width, 320)
