"""Writes src/records.ts, the types of records, of frame.stats and of what may be asked, from the tables of protocol/PROTOCOL.md.

usage: python3 clients/js/records_from_protocol.py [--check]

--check: writes nothing, and fails where the file is not what the tables say. A test runs that; another one keeps the tables
true to the server.
"""
import json
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "python"))
from records_from_protocol import NEVER_ADDED, PARTS, PROTOCOL, class_name, note, tables

RECORDS = os.path.join(HERE, "src", "records.ts")
MESSAGES = os.path.join(HERE, "src", "messages.ts")
HEAD = """/**
 * Types of a scene's records and of frame.stats, with units, and what may be asked. Written from protocol/PROTOCOL.md by
 * records_from_protocol.py: change the tables there.
 */
"""
WORDS = ("name", "text", "id", "`#rrggbb`")


def type_of(text):
    numbers = re.fullmatch(r"(?:(\d+) )?(number|integer)(s?)", text)
    if numbers:
        count = int(numbers[1] or 0)
        if not numbers[3]:
            return "number"
        return "readonly [" + ", ".join(["number"] * count) + "]" if count in (2, 3, 4) else "readonly number[]"
    if text.startswith("`"):
        return " | ".join(f"'{name}'" for name in re.findall("`([^`]+)`", text))
    if text == "lamps":
        return "readonly Lamps[]"
    if text in PARTS:
        return "Transform | readonly number[]" if text == "transform" else class_name(text)
    if text == "boolean":
        return "boolean"
    if text.startswith("id") or text in ("name", "text", "path", "string"):
        return "string"
    raise SystemExit(f"PROTOCOL.md has a type {text!r} that {os.path.basename(__file__)} does not know")


def said(text, indent="    "):
    return f"{indent}/** {text} */\n" if text else ""


def record(name, fields):
    lines = [f"export interface {class_name(name)} {{\n"]
    for field, kind, default, limits, unit, text in fields:
        hint = type_of(kind) + (" | null" if default == "null" else "")
        lines.append(said(note(kind, default, limits, unit, text)) + f"    {field}{'' if default == 'required' else '?'}: {hint};\n")
    return "".join(lines) + "}\n"


def by_type(name, types):
    return f"export interface {name} {{\n" + "".join(f"    {t}: {class_name(t)};\n" for t in types) + "}\n"


def members(text):
    """{"cache": {"records": (unit, meaning)}}: of all tables of members."""
    tree = {}
    for body in re.findall(r"<!-- members:\w+ -->\n(.*?)<!-- end -->", text, re.S):
        for line in body.splitlines()[2:]:
            name, *rest = [cell.strip() for cell in line.strip().strip("|").split(" |")]
            *path, last = name.strip("| `").replace("[]", ".[]").split(".")
            place = tree
            for part in path:
                if not isinstance(place.get(part), dict):
                    place[part] = {"": place.get(part, ("", ""))}
                place = place[part]
            place[last] = (rest[0] if len(rest) > 1 else "", rest[-1])
    return tree


def member_type(unit, meaning):
    if "lists of" in unit:
        return "readonly (readonly number[])[]"
    scalar = "boolean" if unit == "boolean" else "string" if unit in WORDS else "number"
    return f"readonly {scalar}[]" if unit == "numbers" or unit == "`#rrggbb`" else scalar


def inside(tree, indent):
    """The type of an object, of an object of any names (*), or of a list ([])."""
    if "*" in tree:
        return f"Record<string, {inside(tree['*'], indent)}>"
    if "[]" in tree:
        return f"readonly {inside(tree['[]'], indent)}[]"
    lines = []
    for name, what in tree.items():
        if name == "":
            continue
        unit, meaning = what.get("", ("", "")) if isinstance(what, dict) else what
        hint = inside(what, indent + "    ") if isinstance(what, dict) else member_type(unit, meaning)
        if re.search(r"\bnull: ", meaning) and not meaning.startswith("as "):
            hint += " | null"
        optional = "?" if name == "overlay" else ""
        comment = said("; ".join(x for x in (unit, meaning if len(meaning) <= 100 else "see PROTOCOL.md") if x).replace("`", ""),
                       indent + "    ")
        lines.append(f"{comment}{indent}    {name}{optional}: {hint};\n")
    return "{\n" + "".join(lines) + indent + "}"


def methods(text):
    """What the table of roles has, and what every role may ask first."""
    body = re.search(r"### Roles\n.*?\n\|---\|---\|\n(.*?)\n\n", text, re.S)[1]
    return ["session.hello"] + [name for line in body.splitlines() for name in re.findall(r"`(\w+\.?\w*)`", line.split("|")[2])]


def shown_type(value):
    """The type that a value of an example stands for."""
    if isinstance(value, dict):
        return "{ " + "; ".join(f"{name}: {shown_type(v)}" for name, v in value.items()) + " }" if value else "Record<string, never>"
    if isinstance(value, list):
        if len(value) == 3 and all(isinstance(v, (int, float)) for v in value):
            return "readonly [number, number, number]"
        return f"readonly {shown_type(value[0])}[]" if value else "readonly unknown[]"
    return "boolean" if isinstance(value, bool) else "string" if isinstance(value, str) else "null" if value is None else "number"


def by_example(text):
    """Types of requests that messages.ts leaves to the page: what the first example of each takes and is answered."""
    with open(MESSAGES, encoding="utf-8") as file:
        told = set(re.findall(r"^    '?([\w.]+)'?: ", re.search(r"interface ToldParams \{\n(.*?)\n\}", file.read(), re.S)[1], re.M))
    asked, takes, answers = {}, {}, {}
    for line in re.findall(r"^[\u2192\u2190] (\{.*)$", text, re.M):
        message = json.loads(line)
        method = message.get("method")
        if method:
            asked[message.get("id")] = method
            takes.setdefault(method, message.get("params", {}))
        elif "result" in message:
            answers.setdefault(asked.get(message["id"]), message["result"])
    left = [m for m in methods(text) if m not in told]
    missing = [m for m in left if m not in answers]
    if missing:
        sys.exit(f"PROTOCOL.md has no example of an answer to {', '.join(missing)}, and messages.ts does not say what it is")
    return [f"/** {what} */\nexport interface {name} {{\n" + "".join(f"    {m if m.isidentifier() else repr(m)}: {shown_type(of[m])};\n" for m in left) + "}\n"
            for what, name, of in (("What requests take, as the examples of PROTOCOL.md have it, where messages.ts says no more.",
                                    "ParamsByExample", takes),
                                   ("What they are answered.", "AnswersByExample", answers))]


def written(text):
    found = tables(text)
    order = PARTS + [name for name in found if name not in PARTS]
    parts = [HEAD + "\n" + record(order[0], found[order[0]])] + [record(name, found[name]) for name in order[1:]]
    parts.append("/** What can be added, by its type. */\n" + by_type("Added", [n for n in order if n not in PARTS + NEVER_ADDED]))
    parts.append("/** All types of records. */\n" + by_type("Records", [n for n in order if n not in PARTS]))
    parts.append("export interface FrameStats " + inside(members(text), "") + "\n")
    parts.append("export type Method =\n" + "\n".join(f"    | '{name}'" for name in methods(text)) + ";\n")
    parts += by_example(text)
    return "\n".join(parts)


def main():
    with open(PROTOCOL, encoding="utf-8") as file:
        wanted = written(file.read())
    if sys.argv[1:] == ["--check"]:
        with open(RECORDS, encoding="utf-8") as file:
            if file.read() != wanted:
                sys.exit("clients/js/src/records.ts is not what PROTOCOL.md says: python3 clients/js/records_from_protocol.py writes it anew")
    elif sys.argv[1:]:
        sys.exit(__doc__)
    else:
        with open(RECORDS, "w", encoding="utf-8") as file:
            file.write(wanted)


if __name__ == "__main__":
    main()
