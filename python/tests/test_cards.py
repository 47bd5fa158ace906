"""The cards of a dataset, opened by the libraries of the archives that ask for them."""

import itertools

import numpy as np
import pytest

import catseye

mlcroissant = pytest.importorskip("mlcroissant", reason="the registry has no mlcroissant for this machine")


def test_croissant_describes_every_table(data):
    card = mlcroissant.Dataset(jsonld=str(data / "croissant.json"))
    assert not card.metadata.ctx.issues.errors
    sample = catseye.Dataset(data)[0]
    tables = {name: table for name, table in sample.items() if getattr(table, "dtype", None) is not None and table.dtype.names}
    assert {record_set.uuid for record_set in card.metadata.record_sets} == set(tables)
    for name, table in tables.items():
        rows = list(itertools.islice(card.records(name), len(table)))
        assert len(rows) == len(table)
        fields = {key.split("/", 1)[1] for row in rows for key in row}
        assert not rows or fields == {"frame", *table.dtype.names}
    points = list(itertools.islice(card.records("points"), len(sample["points"])))
    np.testing.assert_array_equal([p["points/range_m"] for p in points], sample["points"]["range_m"])
    # An empty text is read as none.
    assert [(p["points/class"] or b"").decode() for p in points] == list(sample["points"]["class"])
    assert [bool(p["points/ghost"]) for p in points] == list(sample["points"]["ghost"])


def test_responsible_ai_fields_are_there(data):
    text = mlcroissant.Dataset(jsonld=str(data / "croissant.json")).metadata
    for key in ("data_collection", "data_limitations", "data_biases", "personal_sensitive_information", "data_use_cases"):
        assert getattr(text, key), key


def test_the_readme_begins_with_a_card(data):
    yaml = pytest.importorskip("yaml")
    text = (data / "README.md").read_text()
    head, rest = text.removeprefix("---\n").split("\n---\n", 1)
    card = yaml.safe_load(head)
    assert card["pretty_name"] and "radar" in card["tags"] and card["size_categories"] == ["n<1K"]
    assert rest.lstrip().startswith(f"# {card['pretty_name']}")
    for config in card["configs"]:
        assert sorted(data.glob(config["data_files"])), config
