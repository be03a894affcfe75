"""Fails where server/SECURITY.md names a test that does not exist, or a line of its tables names none.

usage: security_page.py SOURCE_DIR
"""
import glob
import os
import re
import sys

source = sys.argv[1]
failures = []


def read(*path):
    try:
        with open(os.path.join(source, *path), encoding="utf-8") as file:
            return file.read()
    except FileNotFoundError:
        return None


REGISTERED = {kind: read("tests", kind, "CMakeLists.txt") for kind in ("unit", "e2e", "fuzz", "stress")}
SUFFIX = {"unit": "_test.c", "e2e": "_test.py", "fuzz": "_fuzz.c", "stress": ".py"}


def check_web(kind, name, where):
    """A file of the browser client's tests, or of those of a browser; their folders are registered whole."""
    parts = ("tests", "e2e", "web", name + ".test.mjs") if kind == "e2e" else ("clients", "web", "src", "**", name + ".test.ts")
    if not glob.glob(os.path.join(source, *parts), recursive=True):
        failures.append(f"{where}: there is no such test")


def check(kind, name, one):
    where = f"{kind}.{name}" + (f":{one}" if one else "")
    if (kind, name) == ("unit", "web"):
        check_web(kind, one, where)
        return
    if kind == "e2e" and name.startswith("web."):
        check_web(kind, name[len("web."):], where)
        return
    text = read("tests", kind, name + SUFFIX[kind])
    if text is None or not re.search(rf"\b{name}\b", REGISTERED[kind]):
        failures.append(f"{where}: there is no such test")
    elif one and not re.search(rf"^(?:static void {one}\(void \*\*|    def {one}\(self)", text, re.M):
        failures.append(f"{where}: {kind}.{name} has no such test")


def main():
    page = read("server", "SECURITY.md")
    n = 0
    for number, line in enumerate(page.split("\n"), 1):
        named = re.findall(r"`(unit|e2e|fuzz|stress)\.((?:web\.)?[a-z0-9_]+)(?::([A-Za-z0-9_]+))?`", line)
        for test in named:
            check(*test)
            n += 1
        row = line.startswith("|") and not re.match(r"\|[-|]+\|$", line) and not line.startswith("| who, what |")
        if row and not named:
            failures.append(f"server/SECURITY.md:{number}: no test is named")
    for failure in failures:
        print(failure)
    print(f"{n} tests named, {len(failures)} violations")
    return 1 if failures or n == 0 else 0


sys.exit(main())
