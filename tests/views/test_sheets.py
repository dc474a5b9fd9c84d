from __future__ import annotations

import cv2
import numpy as np
import pytest

from internav_data.records.errors import InternavError, UsageError
from internav_data.views import contact_sheet, write_png


def flat(height, width, colour):
    return np.full((height, width, 3), colour, np.uint8)


def test_pictures_lie_in_rows_each_in_the_middle_of_its_cell():
    sheet = contact_sheet([flat(40, 60, 10), flat(20, 30, 20), flat(40, 60, 30)], columns=2)
    assert sheet.shape == (2 * 48 + 8, 2 * 68 + 8, 3)
    assert (sheet[8:48, 8:68] == 10).all()
    assert (sheet[18:38, 91:121] == 20).all()
    assert (sheet[56:96, 8:68] == 30).all()


def test_labels_are_written_below():
    plain = contact_sheet([flat(40, 60, 255)] * 2, columns=2)
    labelled = contact_sheet([flat(40, 60, 255)] * 2, columns=2, labels=["left", "right"])
    assert labelled.shape[0] == plain.shape[0] + 20
    strip = labelled[48:68]
    assert (strip[:, 8:68] < 128).any()
    assert (strip[:, 76:136] < 128).any()


@pytest.mark.parametrize(
    ("images", "columns", "labels"),
    [([], 2, None), ([flat(4, 4, 0)], 0, None), ([flat(4, 4, 0)], 1, ["a", "b"])],
)
def test_a_sheet_of_nothing_is_refused(images, columns, labels):
    with pytest.raises(UsageError):
        contact_sheet(images, columns, labels)


def test_a_picture_is_read_back_as_it_was(tmp_path):
    image = np.arange(4 * 5 * 3, dtype=np.uint8).reshape(4, 5, 3)
    path = tmp_path / "deep" / "picture.png"
    write_png(path, image)
    assert np.array_equal(cv2.imread(str(path))[..., ::-1], image)
    assert [p.name for p in path.parent.iterdir()] == ["picture.png"]


def test_a_path_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InternavError, match=r"picture\.png"):
        write_png(tmp_path / "file" / "picture.png", flat(2, 2, 0))
    (tmp_path / "taken.png").mkdir()
    with pytest.raises(InternavError, match=r"taken\.png"):
        write_png(tmp_path / "taken.png", flat(2, 2, 0))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "taken.png"]
