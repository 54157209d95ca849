"""What the examiner of a camera driver takes for a picture."""

from __future__ import annotations

import pytest
from sensor_msgs.msg import Image

from autograder.exercises.resources.camera_examiner import Picture, read_picture


@pytest.mark.parametrize(
    ("data", "picture"),
    [
        (b"front-1 7 2\n" + bytes(1000), Picture("front-1", 7, 2)),
        (b"front-1 7 2", Picture("front-1", 7, 2)),
        (b"front-1 7\n", None),
        (b"front-1 7 2 9\n", None),
        (b"front 1 7 2\n", None),
        (b"\xff\xfe\n", None),
        (b"", None),
    ],
)
def test_only_what_a_camera_has_labelled_is_a_picture(data: bytes, picture: Picture | None) -> None:
    assert read_picture(Image(data=data)) == picture
