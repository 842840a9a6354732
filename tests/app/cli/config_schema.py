#!/usr/bin/python3
"""usage: config_schema.py TRUNNION SOURCE

The schema of a config, judged by python3-jsonschema: every config of the project is valid, every key of the page is in
it, and what the readers refuse of single keys the schema refuses too. Exit code 77 (skipped) where that is not here.
"""
import copy
import json
import pathlib
import subprocess
import sys
import tomllib
import unittest

try:
    import jsonschema
except ImportError:
    print("python3-jsonschema is not here")
    sys.exit(77)


def trunnion(*words):
    return json.loads(subprocess.run([BINARY, *words], check=True, capture_output=True, text=True).stdout)


def leaves(value, path=()):
    """(path, value) of every key of a config that is no table."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*path, key))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, inner in enumerate(value):
            yield from leaves(inner, (*path, index))
    else:
        yield path, value


def changed(config, path, key, value):
    """A copy of a config with another last key, or value."""
    out = copy.deepcopy(config)
    table = out
    for step in path[:-1]:
        table = table[step]
    del table[path[-1]]
    table[key] = value
    return out


class Schema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.schema = trunnion("config", "--schema")
        jsonschema.Draft7Validator.check_schema(cls.schema)
        cls.judge = jsonschema.Draft7Validator(cls.schema)
        paths = sorted((SOURCE / "configs").glob("*.toml"))
        cls.configs = {path.name: tomllib.loads(path.read_text()) for path in paths}

    def test_every_config_of_the_project_is_valid(self):
        self.assertGreater(len(self.configs), 10)
        for name, config in self.configs.items():
            self.assertEqual([error.message for error in self.judge.iter_errors(config)], [], name)

    def test_misspelt_keys_are_not(self):
        count = 0
        for name, config in self.configs.items():
            for path, value in leaves(config):
                count += 1
                wrong = changed(config, path, path[-1] + "e", value)
                self.assertFalse(self.judge.is_valid(wrong), (name, path))
        self.assertGreater(count, 1000)

    def test_values_of_another_form_are_not(self):
        for name, config in self.configs.items():
            for path, value in leaves(config):
                wrong = 7 if isinstance(value, (str, bool, list)) else "x"
                self.assertFalse(self.judge.is_valid(changed(config, path, path[-1], wrong)), (name, path))

    def test_ranges_choices_and_required_keys(self):
        mill = self.configs["mill.toml"]
        for path, value in ((("machine", "period_s"), 5), (("machine", "period_s"), 0),
                            (("joint", 0, "type"), "linaer"), (("drives", "type"), "canopne")):
            self.assertFalse(self.judge.is_valid(changed(mill, path, path[-1], value)), path)
        for table, key in (("machine", "name"), ("drives", "type")):
            short = copy.deepcopy(mill)
            del short[table][key]
            self.assertFalse(self.judge.is_valid(short), (table, key))
        for table in ("machine", "joint", "kinematics", "drives"):
            short = {name: value for name, value in mill.items() if name != table}
            self.assertFalse(self.judge.is_valid(short), table)

    def test_keys_of_another_type_are_not(self):
        mill = self.configs["mill.toml"]
        wrong = copy.deepcopy(mill)
        wrong["joint"][0]["min_deg"] = wrong["joint"][0].pop("min_mm")
        self.assertFalse(self.judge.is_valid(wrong))

    def test_every_key_of_the_page_is_in_it_with_its_meaning(self):
        text = json.dumps(self.schema)
        others = ("X", "Y", "X.record", "Y.record", "fault")  # of files that a config names
        for table in trunnion("config", "--keys", "--json")["tables"]:
            if table["table"] in others:
                continue
            for key in table["keys"]:
                self.assertIn(json.dumps(key["key"]) + ": {", text)
                self.assertIn(json.dumps(key["meaning"])[1:-1], text)


if __name__ == "__main__":
    BINARY, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
    unittest.main(argv=[sys.argv[0], "-v"])
