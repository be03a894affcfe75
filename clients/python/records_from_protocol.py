"""Writes lumend/records.py, the types of a scene's records, from the tables of protocol/PROTOCOL.md.

usage: python3 clients/python/records_from_protocol.py [--check]

--check: writes nothing, and fails where the file is not what the tables say. A test runs that; another one keeps the tables
true to the server.
"""
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
PROTOCOL = os.path.join(HERE, "..", "..", "protocol", "PROTOCOL.md")
RECORDS = os.path.join(HERE, "lumend", "records.py")
PARTS = ["texture", "transform", "web", "box", "lamps"]  # members of records, not records
NEVER_ADDED = ["render", "import"]
HEAD = '''"""Types of a scene's records and their fields, with units. Written from protocol/PROTOCOL.md by
records_from_protocol.py: change the tables there."""
from typing import Literal, Required, Sequence, TypedDict, Unpack
'''


def tables(text):
    """{record: [(field, type, default, range, unit, note)]}"""
    found = {}
    for name, body in re.findall(r"<!-- fields:(\w+) -->\n(.*?)<!-- end -->", text, re.S):
        rows = [[cell.strip() for cell in line.strip("|").split(" |")] for line in body.splitlines()[2:]]
        found[name] = [tuple([row[0].strip("| `")] + row[1:6]) for row in rows]
    return found


def class_name(record):
    return record.capitalize()


def python_type(text):
    numbers = re.fullmatch(r"(?:(\d+) )?(number|integer)(s?)", text)
    if numbers:
        scalar = "float" if numbers[2] == "number" else "int"
        return f"Sequence[{scalar}]" if numbers[3] else scalar
    if text.startswith("`"):
        return "Literal[" + ", ".join(f'"{name}"' for name in re.findall("`([^`]+)`", text)) + "]"
    if text == "lamps":
        return "Sequence[Lamps]"
    if text in PARTS:
        return "Transform | Sequence[float]" if text == "transform" else class_name(text)
    if text == "boolean":
        return "bool"
    if text.startswith("id") or text in ("name", "text", "path", "string"):
        return "str"
    raise SystemExit(f"PROTOCOL.md has a type {text!r} that {os.path.basename(__file__)} does not know")


def note(kind, default, limits, unit, text):
    count = re.match(r"\d+ ", kind)
    words = [(count[0] if count else "") + unit, limits, "" if default in ("required", "null") else f"default {default}",
             "see PROTOCOL.md" if len(text) > 100 else text]
    return "; ".join(word.strip() for word in words if word.strip()).replace("`", "")


def record_class(name, fields):
    lines = [f"class {class_name(name)}(TypedDict, total=False):"]
    for field, kind, default, limits, unit, text in fields:
        hint = python_type(kind)
        hint = f"Required[{hint}]" if default == "required" else f"{hint} | None" if default == "null" else hint
        lines.append(f"    {field}: {hint}  # {note(kind, default, limits, unit, text)}".rstrip(" #"))
    return "\n".join(lines)


def adder(name):
    return (f"    def add_{name}(self, id: str, **fields: Unpack[{class_name(name)}]) -> None:\n"
            f"        self.add(\"{name}\", id, **fields)")


def written(text):
    found = tables(text)
    order = PARTS + [name for name in found if name not in PARTS]
    classes = [record_class(name, found[name]) for name in order]
    adders = [adder(name) for name in order if name not in PARTS + NEVER_ADDED]
    mixin = ("class AddRecords:\n    \"\"\"Of Edit: what each type of record is made of is known to editors and checkers.\"\"\"\n\n"
             "    def add(self, type: str, id: str, **fields) -> None:\n        raise NotImplementedError\n\n" +
             "\n\n".join(adders))
    return "\n\n\n".join([HEAD.rstrip(), *classes, mixin]) + "\n"


def main():
    with open(PROTOCOL, encoding="utf-8") as file:
        wanted = written(file.read())
    if sys.argv[1:] == ["--check"]:
        with open(RECORDS, encoding="utf-8") as file:
            if file.read() != wanted:
                sys.exit("clients/python/lumend/records.py is not what PROTOCOL.md says: "
                         "python3 clients/python/records_from_protocol.py writes it anew")
    elif sys.argv[1:]:
        sys.exit(__doc__)
    else:
        with open(RECORDS, "w", encoding="utf-8") as file:
            file.write(wanted)


if __name__ == "__main__":
    main()
