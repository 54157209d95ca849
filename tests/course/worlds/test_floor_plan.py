"""Floor plans: those that are installed, and what is wrong with others."""

from __future__ import annotations

from pathlib import Path

import pytest

from course.worlds.floor_plan import FloorPlanError, load_floor_plan, plan_names

SOUND = "name: hall\nsize: [10, 8]\nstart: {x: 2, y: 2}\n"


def test_there_are_an_aisle_a_corridor_a_hall_and_a_warehouse():
    assert plan_names() == ["aisle", "corridor", "hall", "warehouse"]
    warehouse = load_floor_plan("warehouse")
    assert (warehouse.name, warehouse.slip) == ("warehouse", 0.0)
    assert len(warehouse.shelves) == 6
    assert load_floor_plan("corridor").people


def test_an_author_draws_another_one(tmp_path: Path):
    path = tmp_path / "mine.yaml"
    path.write_text(SOUND, encoding="utf-8")
    assert load_floor_plan(path) == load_floor_plan(str(path))
    assert load_floor_plan(path).all_walls[0] == (0.0, 0.0, 10.0, 0.0)


def test_an_unknown_name_and_an_unknown_path_say_what_there_is(tmp_path: Path):
    with pytest.raises(FloorPlanError) as caught:
        load_floor_plan("warehosue")
    assert str(caught.value) == (
        "There is no world 'warehosue': there are aisle, corridor, hall, warehouse, or give the "
        "path of a floor plan of your own, such as './my_floor.yaml'. Did you mean 'warehouse'?"
    )
    with pytest.raises(FloorPlanError, match=r"no floor plan .*none\.yaml: look at its path"):
        load_floor_plan(tmp_path / "none.yaml")
    with pytest.raises(FloorPlanError, match="cannot be read: Is a directory"):
        load_floor_plan(tmp_path)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "mine.yaml: here must stand fields with their values, such as 'name: my_floor'."),
        ("name: hall\nsize: [10, 8]\n", "mine.yaml, field start: it is missing: add it."),
        (SOUND + "shelfs: []\n", "mine.yaml, field shelfs: there is no such field; there are name, "
         "size, start, charger, stations, walls, shelves, people, slip, interfaces: rename or "
         "delete it. Did you mean 'shelves'?"),
        (SOUND + "people:\n  - {path: [[1, 1], [2, 2]], sped: 1}\n", "mine.yaml, field people 1 "
         "sped: there is no such field; there are path, speed, radius: rename or delete it (and 1 "
         "more). Did you mean 'speed'?"),
        (SOUND + "people:\n  - {path: [[1, 1], [2, 2]], speed: 1, hat: red}\n", "mine.yaml, field "
         "people 1 hat: there is no such field; there are path, speed, radius: rename or delete "
         "it."),
        (SOUND + "interfaces: [line]\n", "mine.yaml, field stations: a line begins at the first "
         "station, so write at least one."),
        (SOUND + "people:\n  - {path: [[1, 1], [2, 2]], speed: fast}\n", "mine.yaml, field people "
         "1 speed: it must be a valid number, unable to parse string as a number, not 'fast': "
         "correct it."),
        (SOUND + "people:\n  - {path: [[1, 1], [12, 2]], speed: 1}\n", "mine.yaml, field people 1 "
         "path: (12, 2) is not on the floor, which goes from (0, 0) to (10, 8): move it."),
        (SOUND + "shelves: [[1.5, 1.5, 1, 1]]\n", "mine.yaml, field start: the robot has a radius "
         "of 0.2 m, and something is 0.00 m from its middle: move one of them."),
        (SOUND + "shelves: [[5, 5, -1, 1]]\n", "mine.yaml, field shelves 1: width and height must "
         "be above 0, not -1 and 1: x and y are its lower left corner."),
        (SOUND + "stations:\n- {name: a, x: 1, y: 1}\n- {name: a, x: 2, y: 1}\n", "mine.yaml, "
         "field stations 2 name: 'a' is there already: give each its own name."),
        (SOUND.replace("hall", "My Hall"), "mine.yaml, field name: 'My Hall' is no name of a node: "
         "write lower-case letters, digits and _."),
        (SOUND.replace("[10, 8]", "[10, 1]"), "mine.yaml, field size 2: it must be greater than or "
         "equal to 2, not '1': correct it."),
        ("name: [hall\n", "mine.yaml is not valid YAML: line 2: expected ',' or ']', but got "
         "'<stream end>'; look at the indentation and the brackets there."),
    ],
)  # fmt: skip
def test_a_plan_that_is_not_sound_is_answered_in_a_sentence(tmp_path: Path, text, sentence):
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FloorPlanError) as caught:
        load_floor_plan(path)
    assert str(caught.value) == sentence


def test_a_file_that_is_no_plan_at_all_is_not_read_whole(tmp_path: Path):
    path = tmp_path / "big.yaml"
    path.write_bytes(b"#" * 300_000)
    with pytest.raises(FloorPlanError, match="more than 200 kB"):
        load_floor_plan(path)
