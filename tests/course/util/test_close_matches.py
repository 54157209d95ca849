"""The name that comes closest to one which does not exist."""

from __future__ import annotations

from course.util.close_matches import close_match, did_you_mean, is_it


def test_the_closest_name_is_asked_about() -> None:
    assert close_match("/scna", ["/odom", "/scan", "/cmd_vel"]) == "/scan"
    assert did_you_mean("qso", {"qos", "safety"}) == " Did you mean 'qos'?"
    assert is_it("ada.lovelce", iter(["bob", "ada.lovelace"])) == " (is it 'ada.lovelace'?)"


def test_nothing_is_asked_where_no_name_is_close() -> None:
    assert close_match("/scan", ["/battery"]) == ""
    assert did_you_mean("qos", []) == is_it("qos", ["resources"]) == ""
