"""QTI for Canvas: text2qti accepts the bank, and the package is sound QTI 1.2 with the right keys.

What is allowed where is taken from the IMS QTI 1.2 ASI XML binding (sections 3.4 to 3.6).
"""

from __future__ import annotations

import html
import io
import re
import zipfile
from typing import Any
from xml.etree import ElementTree

import pytest

from quizzes.bank import loader
from quizzes.bank.contents import Bank, Matching, Multiple, Numeric, Ordering, Variant
from quizzes.exchange import qti
from quizzes.exchange.platform_questions import ExchangeError

BANK = loader.load_bank("ch05")
NS = "{http://www.imsglobal.org/xsd/ims_qtiasiv1p2}"
CP = "{http://www.imsglobal.org/xsd/imsccv1p1/imscp_v1p1}"

# The children of each element, in their order, as far as the package uses them.
CHILDREN = {
    "questestinterop": "assessment",
    "assessment": "qtimetadata section+",
    "section": "selection_ordering? (section|item)*",
    "selection_ordering": "selection",
    "selection": "selection_number selection_extension",
    "item": "itemmetadata presentation resprocessing itemfeedback*",
    "itemmetadata": "qtimetadata",
    "qtimetadata": "qtimetadatafield+",
    "qtimetadatafield": "fieldlabel fieldentry",
    "presentation": "material (response_lid|response_str)",
    "response_lid": "render_choice",
    "response_str": "render_fib",
    "render_choice": "response_label+",
    "render_fib": "response_label",
    "response_label": "material?",
    "material": "mattext",
    "resprocessing": "outcomes respcondition+",
    "outcomes": "decvar",
    "respcondition": "conditionvar setvar? displayfeedback?",
    "itemfeedback": "flow_mat",
    "flow_mat": "material",
}


@pytest.fixture(scope="module")
def package() -> zipfile.ZipFile:
    content, _ = qti.make_package(BANK)
    archive = zipfile.ZipFile(io.BytesIO(content))
    assert archive.testzip() is None
    return archive


@pytest.fixture(scope="module")
def assessment(package: zipfile.ZipFile) -> ElementTree.Element:
    [name] = [n for n in package.namelist() if re.search(r"assessment_\w+\.xml$", n)
              and not n.endswith("_meta.xml")]  # fmt: skip
    return ElementTree.fromstring(package.read(name))


def items(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    return {item.attrib["title"]: item for item in root.iter(f"{NS}item")}


def text(element: ElementTree.Element | None) -> str:
    assert element is not None
    return "".join(element.itertext()).strip()


def plain(markup: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]+>", "", markup)).split())


def test_the_manifest_names_every_file_and_every_file_is_there(package: zipfile.ZipFile) -> None:
    manifest = ElementTree.fromstring(package.read("imsmanifest.xml"))
    named = {file.attrib["href"] for file in manifest.iter(f"{CP}file")}
    there = {n for n in package.namelist() if not n.endswith("/")} - {"imsmanifest.xml"}
    assert named == there
    types = [resource.attrib["type"] for resource in manifest.iter(f"{CP}resource")]
    assert types.count("imsqti_xmlv1p2") == 1
    resources = {resource.attrib["identifier"] for resource in manifest.iter(f"{CP}resource")}
    for dependency in manifest.iter(f"{CP}dependency"):
        assert dependency.attrib["identifierref"] in resources


def test_elements_stand_where_qti_1_2_has_them(assessment: ElementTree.Element) -> None:
    for element in assessment.iter():
        name = element.tag.removeprefix(NS)
        if name in CHILDREN:
            children = "".join(f"{child.tag.removeprefix(NS)} " for child in element)
            assert re.fullmatch(_model(CHILDREN[name]), children), name


def _model(children: str) -> str:
    """Return "a b? (c|d)*" as a regular expression over names that a blank follows each."""
    return "".join(re.sub(r"\w+", lambda found: rf"(?:{found[0]}\s)", children).split())


def test_identifiers_and_references_fit_together(assessment: ElementTree.Element) -> None:
    idents = [
        e.attrib["ident"] for e in assessment.iter() if e.tag in (f"{NS}item", f"{NS}section")
    ]
    assert len(set(idents)) == len(idents)
    for name, item in items(assessment).items():
        labels = [label.attrib["ident"] for label in item.iter(f"{NS}response_label")]
        assert len(set(labels)) == len(labels), name
        feedback = {e.attrib["ident"] for e in item.iter(f"{NS}itemfeedback")}
        shown = {e.attrib["linkrefid"] for e in item.iter(f"{NS}displayfeedback")}
        assert shown == feedback, name
        responses = {e.attrib["ident"] for kind in ("response_lid", "response_str")
                     for e in item.iter(f"{NS}{kind}")}  # fmt: skip
        for kind in ("varequal", "vargte", "varlte"):
            for test in item.iter(f"{NS}{kind}"):
                assert test.attrib["respident"] in responses, name
                if item.find(f".//{NS}response_lid") is not None:
                    assert text(test) in labels, name
        scores = [text(e) for e in item.iter(f"{NS}setvar")]
        assert scores == ["100"], name


def test_each_concept_is_a_group_that_picks_one_variant(assessment: ElementTree.Element) -> None:
    root = assessment.find(f".//{NS}section[@ident='root_section']")
    assert root is not None
    groups = root.findall(f"{NS}section")
    assert [[item.attrib["title"] for item in group.findall(f"{NS}item")] for group in groups] == [
        [variant.id for variant in concept.variants] for concept in BANK.concepts
    ]
    assert {text(group.find(f".//{NS}selection_number")) for group in groups} == {"1"}


def test_the_package_is_worth_what_is_drawn(package: zipfile.ZipFile) -> None:
    assert meta(package, "points_possible") == ["5.0", "5.0"], "of the quiz and its assignment"
    assert points_of_groups(package) == [(1, 1)] * 5, "one question of each group, one point"


def test_attempts_and_how_they_count_are_in_the_package(package: zipfile.ZipFile) -> None:
    assert meta(package, "allowed_attempts") == ["20"]
    assert meta(package, "scoring_policy") == ["keep_highest"]
    assert meta(package, "show_correct_answers") == ["true"]


def test_a_closed_quiz_shows_no_results_in_canvas() -> None:
    bank = loader.read_bank(loader.BANKS.parent / "examples" / "exam.yaml")
    archive = zipfile.ZipFile(io.BytesIO(qti.make_package(bank)[0]))
    assert meta(archive, "points_possible") == ["3.0", "3.0"]
    assert meta(archive, "allowed_attempts") == ["1"]
    assert meta(archive, "show_correct_answers") == ["false"]
    assert meta(archive, "hide_results") == ["always"]
    assert points_of_groups(archive) == [(1, 1)] * 3


def meta(package: zipfile.ZipFile, name: str) -> list[str]:
    """The values of a setting of the quiz, as Canvas reads them."""
    [file] = [n for n in package.namelist() if n.endswith("assessment_meta.xml")]
    root = ElementTree.fromstring(package.read(file))
    return [text(e) for e in root.iter() if e.tag.rpartition("}")[2] == name]


def points_of_groups(package: zipfile.ZipFile) -> list[tuple[int, int]]:
    """How many questions each group draws, and the points of each."""
    [file] = [n for n in package.namelist() if re.search(r"assessment_\w+\.xml$", n)
              and not n.endswith("_meta.xml")]  # fmt: skip
    root = ElementTree.fromstring(package.read(file))
    return [
        (int(text(s.find(f"{NS}selection_number"))), int(text(s.find(f".//{NS}points_per_item"))))
        for s in root.iter(f"{NS}selection")
    ]


def test_a_group_has_its_concepts_name(assessment: ElementTree.Element) -> None:
    root = assessment.find(f".//{NS}section[@ident='root_section']")
    assert root is not None
    titles = [group.attrib["title"] for group in root.findall(f"{NS}section")]
    assert titles == [concept.id for concept in BANK.concepts]


def right_texts(item: ElementTree.Element) -> set[str]:
    """The texts of the options that earn the points."""
    [condition] = [c for c in item.iter(f"{NS}respcondition") if c.find(f"{NS}setvar") is not None]
    wrong = {text(e) for e in condition.findall(f".//{NS}not/{NS}varequal")}
    right = {text(e) for e in condition.iter(f"{NS}varequal")} - wrong
    return {
        plain(text(label.find(f"{NS}material")))
        for label in item.iter(f"{NS}response_label")
        if label.attrib["ident"] in right
    }


def written(markdown: str) -> str:
    return " ".join(markdown.replace("`", "").replace("*", "").split())


@pytest.mark.parametrize("variant", [v for c in BANK.concepts for v in c.variants],
                         ids=lambda variant: variant.id)  # fmt: skip
def test_the_right_answer_is_the_banks_key(
    assessment: ElementTree.Element, variant: Variant
) -> None:
    item = items(assessment)[variant.id]
    if isinstance(variant, Numeric):
        low, high = (float(text(item.find(f".//{NS}{kind}"))) for kind in ("vargte", "varlte"))
        assert low == pytest.approx(variant.answer - variant.tolerance)
        assert high == pytest.approx(variant.answer + variant.tolerance)
    elif isinstance(variant, Ordering | Matching):
        [key] = right_texts(item)
        stem = text(item.find(f"{NS}presentation/{NS}material"))
        shown = dict(re.findall(r"<li>([A-Z]): (.*?)</li>", stem))
        wanted = (
            variant.items if isinstance(variant, Ordering) else [p.right for p in variant.pairs]
        )
        assert [plain(shown[letter]) for letter in re.findall(r"[A-Z]", key)] == [
            written(one) for one in wanted
        ]
    else:
        options = {written(option.text) for option in variant.options if option.correct}
        assert {written(one) for one in right_texts(item)} == options
        cardinality = item.find(f".//{NS}response_lid").attrib["rcardinality"]  # type: ignore[union-attr]
        assert cardinality == ("Multiple" if isinstance(variant, Multiple) else "Single")
        assert len(list(item.iter(f"{NS}itemfeedback"))) == len(variant.options)


def test_code_keeps_its_indentation(assessment: ElementTree.Element) -> None:
    stem = text(items(assessment)["pattern-navigation-3"].find(f"{NS}presentation/{NS}material"))
    assert "    for step in range(1, 5):\n        goal_handle" in html.unescape(stem)


def test_the_picture_is_inside(package: zipfile.ZipFile) -> None:
    assert (
        package.read("images/ch05-camera.svg")
        == (BANK.folder / "assets" / "ch05-camera.svg").read_bytes()
    )


def test_the_exporter_says_what_qti_cannot_hold() -> None:
    said = " ".join(qti.make_package(BANK)[1])
    for part in ("misconceptions", "pass mark", "pattern-navigation-2", "pattern-camera-3"):
        assert part in said


def changed(**changes: Any) -> Bank:
    """The bank, fields of its first numeric question replaced."""
    data = BANK.model_dump()
    [numeric] = [v for v in data["concepts"][1]["variants"] if v["kind"] == "numeric"]
    numeric.update(changes)
    bank = Bank.model_validate(data)
    bank._folder = BANK.folder
    return bank


def test_what_text2qti_refuses_is_one_sentence_that_names_the_item() -> None:
    with pytest.raises(ExchangeError) as caught:
        qti.make_package(changed(answer=0.0, tolerance=0.0, traps=[]))
    assert str(caught.value).startswith(
        "ch05.yaml, item 'pattern-camera-3' cannot be written as QTI: "
    )
    assert "\n" not in str(caught.value)


def test_two_questions_in_the_same_words_are_named() -> None:
    twin = BANK.concepts[0].variants[0]
    data = BANK.model_dump()
    data["concepts"][1]["variants"][0]["stem"] = twin.stem
    data["concepts"][1]["variants"][0]["code"] = None
    bank = Bank.model_validate(data)
    bank._folder = BANK.folder
    with pytest.raises(ExchangeError, match=rf"items '{twin.id}' and '.*' ask the same thing"):
        qti.make_package(bank)


@pytest.mark.parametrize(
    "stem",
    [
        "1. a list?\n2. of two",
        "What?\n\n%  not a comment\n\nGROUP\nEND_GROUP",
        "What?\n\n```{.python .run}\nprint(1)\n```",
        "a) not an option\n*b) nor this\n... nor feedback?",
        "Title: no title\nPoints: 100\n= 3?",
    ],
)
def test_no_text_is_taken_for_a_command(stem: str) -> None:
    content, _ = qti.make_package(changed(stem=stem))
    archive = zipfile.ZipFile(io.BytesIO(content))
    [name] = [n for n in archive.namelist() if n.endswith(".xml") and n.count("text2qti_") == 2
              and "meta" not in n]  # fmt: skip
    root = ElementTree.fromstring(archive.read(name))
    assert len(items(root)) == sum(len(concept.variants) for concept in BANK.concepts)
    shown = plain(text(items(root)["pattern-camera-3"].find(f"{NS}presentation/{NS}material")))
    for word in re.findall(r"[a-zA-Z]{3,}", stem.replace(".python .run", "")):
        assert word in shown
