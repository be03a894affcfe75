"""Fails when a folder uses what it must not: the dependency rule of the README, on sources and on linked symbols.

usage: architecture.py SOURCE_DIR BUILD_DIR
"""
import os
import re
import subprocess
import sys

source, build = sys.argv[1], sys.argv[2]
failures = []

# folder -> our folders it may include
MAY_INCLUDE = {
    "core": {"core"},
    "protocol": {"protocol"},
    "server": {"core", "protocol", "server"},
    "clients": {"protocol", "clients"},
    "tests": {"core", "protocol", "server", "clients", "tests"},
}
# rooms of a folder, from the ground up: those of one line may use each other and all before them
LAYERS = {
    "core": [
        "base math",
        "accel film image metric interleave",
        "scene material light medium",
        "trace",
        "path",
        "vpl",
        "cache",
        "pass",
        "measure",
        "effect",
        "method",
        "render",
    ],
    "protocol": ["base", "json", "message", "record", "op", "document"],
    "server": ["base", "farm", "import", "importer", "stream", "journal", "project", "desk", "world", "export", "report", "director", "net", "cli"],
}
# the same of the browser client, whose rooms are in clients/web/src
WEB_LAYERS = ["lib", "protocol", "view", "state", "ui"]
# rooms of core/effect -> others of them that they may use
EFFECT_MAY_USE = {
    "direct": set(),
    "many_lights": {"direct"},
    "area_shadow": {"direct", "many_lights"},
    "indirect": set(),
    "specular": {"direct", "indirect"},
    "gloss": {"direct"},
    "fog": {"direct"},
    "antialias": {"direct"},
    "ais": set(),
    "path": set(),
}
LAYER_OF = {f"{folder}/{room}": i for folder, lines in LAYERS.items() for i, rooms in enumerate(lines) for room in rooms.split()}
# third-party header prefix -> the only files that may include it
ONLY_IN = {
    r"embree\d?/": r"core/accel/",
    r"libwebsockets\.h": r"server/net/net(_http\.c|_flow\.c|_internal\.h|\.c)|clients/replay/ws\.c",
    r"openexr\.h|OpenEXR/": r"core/image/",
    r"kiss_fft": r"core/metric/fft\.c",
    r"cjson/": r"protocol/|server/|clients/|tests/",
    r"turbojpeg\.h|spng\.h|zlib\.h": r"server/|clients/|tests/",
    r"webp/": r"server/stream/webp\.c|tests/unit/webp_test\.c|tests/bench/codecs\.c",
    r"vpx/": r"server/stream/vp9\.c|tests/unit/vp9_test\.c|tests/bench/video\.c",
    r"openssl/": r"server/journal/|server/net/people\.c|server/net/tls(_pair|_ask)?\.[ch]|tests/unit/",
    r"assimp/|meshoptimizer\.h|seccomp\.h": r"server/importer/",
    r"mpi\.h": r"server/farm/farm_mpi\.c",
    r"sys/socket\.h|netinet/|arpa/": r"server/|clients/|tests/",
}
# static library -> symbols it must not need
MUST_NOT_NEED = {
    "core/liblum_core.a": r"^(lws_|cJSON_|tj[A-Z]|spng_|WebP|vpx_|socket$|connect$|accept$|lum_((record|op|document|proto)(_|$)|frame_))",
    "protocol/liblum_protocol.a": r"^(lws_|rtc[A-Z]|exr_|socket$|lum_(scene|snapshot|view|film|accel|pool|calloc|log)(_|$))",
}


def tracked_names():
    out = subprocess.run(["git", "-C", source, "ls-files"], capture_output=True, text=True)
    if out.returncode == 0 and out.stdout:
        names = out.stdout.split()
    else:  # a source archive
        names = [os.path.relpath(os.path.join(d, f), source) for d, _, fs in os.walk(source) for f in fs]
        names = [n for n in names if not n.startswith(("build/", ".git/")) and "node_modules/" not in n]
    return [n for n in names if os.path.exists(os.path.join(source, n))]


def room_of(name):
    """The room of a file or header: core/vpl of core/vpl/vpl.h."""
    return "/".join(name.split("/")[:2])


def check_layers(where, room, other):
    for r in (room, other):
        if r not in LAYER_OF:
            failures.append(f"{where}: {r} has no place among the layers")
            return
    if LAYER_OF[other] > LAYER_OF[room]:
        failures.append(f"{where}: {room} must not include {other}, which stands above it")


def check_web_layers():
    for name in tracked_names():
        m = re.fullmatch(r"clients/web/src/(\w+)/[\w.]+\.tsx?", name)
        if not m:
            continue
        if m.group(1) not in WEB_LAYERS:
            failures.append(f"{name}: {m.group(1)} has no place among the layers")
            continue
        with open(os.path.join(source, name), encoding="utf-8") as f:
            for other in re.findall(r"from '\.\./(\w+)/", f.read()):
                if other not in WEB_LAYERS or WEB_LAYERS.index(other) > WEB_LAYERS.index(m.group(1)):
                    failures.append(f"{name}: {m.group(1)} must not import {other}, which stands above it")


def check_effects(where, room, other):
    if room != other and other not in EFFECT_MAY_USE.get(room, set()):
        failures.append(f"{where}: core/effect/{room} must not include core/effect/{other}")


def check_include(name, number, line):
    folder = name.split("/")[0]
    m = re.match(r'\s*#\s*include\s*([<"])([^>"]+)[>"]', line)
    if not m:
        return
    where, header = f"{name}:{number}", m.group(2)
    if m.group(1) == '"':
        target = header.split("/")[0]
        if target not in MAY_INCLUDE.get(folder, set()):
            failures.append(f"{where}: {folder}/ must not include {header}")
        if folder in LAYERS and target == folder:
            check_layers(where, room_of(name), room_of(header))
        if name.startswith("core/effect/") and header.startswith("core/effect/"):
            check_effects(where, name.split("/")[2], header.split("/")[2])
    for pattern, allowed in ONLY_IN.items():
        if re.match(pattern, header) and not re.match(allowed, name):
            failures.append(f"{where}: {header} may be included only in {allowed}")


def check_includes(name):
    with open(os.path.join(source, name), encoding="utf-8") as f:
        for number, line in enumerate(f, 1):
            check_include(name, number, line)


def includes_of(name):
    with open(os.path.join(source, name), encoding="utf-8") as f:
        return re.findall(r'^\s*#\s*include\s*"([^"]+)"', f.read(), re.M)


def check_cycles(includes):
    """No file of ours may include itself by way of others."""
    done, trail = set(), []

    def visit(name):
        if name in trail:
            failures.append("includes itself: " + " -> ".join(trail[trail.index(name):] + [name]))
        elif name not in done:
            trail.append(name)
            for header in includes.get(name, []):
                visit(header)
            trail.pop()
            done.add(name)

    for name in includes:
        visit(name)


# file -> what it must be refused
PLANTS = {
    "core/vpl/gather.c": '"core/render/view.h"',
    "core/effect/gloss/glossy.c": '"core/effect/fog/airlight.h"',
    "core/film/film.c": "<cjson/cJSON.h>",
    "protocol/json/read.c": '"protocol/record/record.h"',
    "protocol/base/hash.c": '"core/base/base.h"',
    "server/stream/encode.c": '"server/net/session.h"',
    "clients/replay/main.c": '"server/net/net.h"',
}


def check_plants(includes):
    """These checks notice what is wrong: each include that is planted, and a cycle made of one that is there."""
    def is_noticed(check, *args):
        before = len(failures)
        check(*args)
        noticed = len(failures) > before
        del failures[before:]
        return noticed

    for name, header in PLANTS.items():
        if not os.path.exists(os.path.join(source, name)) or not is_noticed(check_include, name, 0, f"#include {header}"):
            failures.append(f"{name}: {header} planted there is not noticed")
    for folder in LAYERS:
        name = next(n for n in includes if n.startswith(folder) and includes[n] and includes[n][0] in includes)
        header = includes[name][0]
        if not is_noticed(check_cycles, {**includes, header: includes[header] + [name]}):
            failures.append(f"{header}: a cycle by way of {name} is not noticed")


def check_sizes(names):
    """What a reader takes in at once: files, headers, and rooms of one effect."""
    rooms = {}
    for name in names:
        if name.startswith("tests/"):
            continue
        with open(os.path.join(source, name), encoding="utf-8") as f:
            n = len(f.readlines())
        most = 149 if name.endswith(".h") else 600
        if n > most:
            failures.append(f"{name}: {n} lines, and it may have {most}")
        if name.startswith("core/effect/"):
            room = os.path.dirname(name)
            rooms[room] = rooms.get(room, 0) + n
    failures.extend(f"{room}: {n} lines, and a room of one effect may have 1999" for room, n in rooms.items() if n > 1999)


def check_paths():
    """The files of ours that comments name are there, by path or, of C, by name alone."""
    ours = r"(?<![\w/.-])((?:core|server|protocol|clients|tests|docker)/[\w/.-]*\.(?:c|h|py|md|jsonl|cmake))\b"
    tracked = tracked_names()
    by_name = {os.path.basename(n) for n in tracked}
    for name in tracked:
        if name.endswith((".c", ".h")):
            with open(os.path.join(source, name), encoding="utf-8") as f:
                for comment in re.findall(r"/\*.*?\*/", f.read(), re.S):
                    for other in re.findall(r"(?<![\w/.*-])([a-z]\w*\.c)\b", comment):
                        if other not in by_name:
                            failures.append(f"{name}: there is no {other}")
        if name.endswith((".c", ".h", ".py", ".txt", ".cmake")):
            with open(os.path.join(source, name), encoding="utf-8") as f:
                for path in re.findall(ours, f.read()):
                    if not os.path.exists(os.path.join(source, path)):
                        failures.append(f"{name}: there is no {path}")


# what our comments cited when their sources were pages that are not here
NOT_HERE = r"\bDESIGN\b|\balgorithms (?:[A-Z](?:\.\d)?|\d)\b"


def registered(name):
    """Names of the tests that a test program runs, by cmocka's macro, by one of ours or by a table of names; none if it is not built."""
    with open(os.path.join(source, os.path.dirname(name), "CMakeLists.txt"), encoding="utf-8") as f:
        built = f.read()
    if "CONFIGURE_DEPENDS *_test.c)" not in built and os.path.basename(name)[:-len("_test.c")] not in re.findall(r"\w+", built):
        return set()
    with open(os.path.join(source, name), encoding="utf-8") as f:
        text = f.read()
    return set(re.findall(r"(?:cmocka_unit_test\w*|\b[A-Z_]*TEST[A-Z_]*)\(\s*(\w+)", text)) | set(re.findall(r'[{]"(\w+)"', text))


def check_hard_cases(text):
    """The table of hard cases: numbers without a gap, methods that there are, and at least one test each, all of which run."""
    with open(os.path.join(source, "core/method/method.c"), encoding="utf-8") as f:
        methods = set(re.findall(r'\.name = "([a-z-]+)"', f.read()))
    rows = re.findall(r"^\| H(\d+) \| (.*) \|$", text, re.M)
    failures.extend(f"core/NOTES.md: H{i + 1} is missing" for i in range(len(rows)) if int(rows[i][0]) != i + 1)
    for number, row in rows:
        cells = row.split(" | ")
        cited = re.findall(r"`(tests/[a-z0-9_/]+_test\.c)`(?:: ([a-z0-9_, ]+))?", cells[-1])
        if len(cells) != 5 or not cited:
            failures.append(f"core/NOTES.md: H{number} has {len(cells)} cells instead of 5, or no test")
        failures.extend(f"core/NOTES.md: H{number}: no method {m}" for m in re.findall(r"`([a-z-]+)`", cells[-2]) if m not in methods)
        for name, tests in cited:
            there = registered(name) if os.path.exists(os.path.join(source, name)) else set()
            if not there:
                failures.append(f"core/NOTES.md: H{number}: {name} is no test that is built")
            failures.extend(f"core/NOTES.md: H{number}: {name} runs no test {test.strip()}"
                            for test in tests.split(",") if test.strip() and test.strip() not in there)


def check_notes(names):
    """What comments cite of core/NOTES.md is there, and no page is cited that is not."""
    with open(os.path.join(source, "core/NOTES.md"), encoding="utf-8") as f:
        text = f.read()
    check_hard_cases(text)
    notes = set(re.findall(r"^(?:- \*\*|\| )([RH]\d+)\b", text, re.M))
    for name in names:
        with open(os.path.join(source, name), encoding="utf-8") as f:
            text = f.read()
        failures.extend(f"{name}: nothing here is called {other}" for other in re.findall(NOT_HERE, text))
        cited = re.findall(r"NOTES ([RH]\d+(?:, [RH]\d+)*)|\[(H\d+)\]", text)
        for note in sum((re.findall(r"[RH]\d+", " ".join(c)) for c in cited), []):
            if note not in notes:
                failures.append(f"{name}: core/NOTES.md has no {note}")


PAGES = ["README.md", "clients/GUIDE.md", "core/ARCHITECTURE.md", "core/GLOSSARY.md", "core/NOTES.md", "protocol/PROTOCOL.md",
         "tests/bench/RESULTS.md"]


def check_pages():
    """What our pages name is there: files by path or by name, links, and identifiers that begin with lum_."""
    out = subprocess.run(["git", "-C", source, "ls-files"], capture_output=True, text=True)
    files = [n for n in out.stdout.split() if os.path.exists(os.path.join(source, n))]
    if not files:  # a source archive
        return
    contents = {}
    for name in files:
        if name.endswith((".c", ".h", ".ts", ".tsx")):
            with open(os.path.join(source, name), encoding="utf-8") as f:
                contents[name] = f.read()
    words = set(re.findall(r"\b[Ll][Uu][Mm]_\w+", "\n".join(contents.values())))
    for page in PAGES:
        with open(os.path.join(source, page), encoding="utf-8") as f:
            text = re.sub(r"^```diff\n.*?^```\n", "", f.read(), flags=re.M | re.S)  # of changes that were not kept
        paths = re.findall(r"\b(?:core|protocol|server|clients|tests|docker)/[\w./-]+\.(?:c|h|py|md|ts|tsx|mjs|jpg|png)\b", text)
        links = [os.path.join(os.path.dirname(page), link) for link in re.findall(r"\]\(([^):#]+)\)", text)]
        for path in paths:
            if not os.path.exists(os.path.join(source, path)) and not os.path.exists(os.path.join(source, os.path.dirname(page), path)):
                failures.append(f"{page}: there is no {path}")
        for path in links:
            if not os.path.exists(os.path.join(source, path)):
                failures.append(f"{page}: there is no {path}")
        for name in re.findall(r"(?<![\w./-])((?:[\w-]+/)*\w+\.(?:c|h|py|ts))\b", text):
            if not any(("/" + f).endswith("/" + name) for f in files):
                failures.append(f"{page}: there is no {name}")
        for functions, path in re.findall(r"((?:`\w+`(?:, | and )?)+) in `([\w/]+\.(?:[ch]|tsx?))`", text):
            for function in re.findall(r"\w+", functions.replace(" and ", " ")):
                if not re.search(rf"\b{function}\b", contents.get(path, "")):
                    failures.append(f"{page}: {path} has no {function}")
        for word in re.findall(r"\b[Ll][Uu][Mm]_\w+", text):
            if word not in words and not any(w.startswith(word) for w in words):
                failures.append(f"{page}: nothing is called {word}")


def check_room_tables():
    """The tables of rooms in core/ARCHITECTURE.md have every room there is, from the ground up."""
    with open(os.path.join(source, "core/ARCHITECTURE.md"), encoding="utf-8") as f:
        text = f.read()
    tests = {n.split("/")[1] for n in tracked_names() if n.startswith("tests/") and n.count("/") > 1}
    expected = {**LAYERS, "the browser client": WEB_LAYERS + ["style"], "tests": [" ".join(sorted(tests))]}
    for folder, lines in expected.items():
        section = re.search(rf"^## Rooms of {folder}\n(.*?)^## ", text, re.M | re.S)
        cells = re.findall(r"^\| (`[^|]*`) \|", section.group(1), re.M) if section else []
        told = [room for cell in cells for room in re.findall(r"`([\w-]+)/?`", cell)]
        layer_of = {room: i for i, line in enumerate(lines) for room in line.split()}
        failures.extend(f"core/ARCHITECTURE.md: rooms of {folder} lack {room}" for room in layer_of if room not in told)
        failures.extend(f"core/ARCHITECTURE.md: rooms of {folder} have {room}, which is none" for room in told if room not in layer_of)
        order = [layer_of[room] for room in told if room in layer_of]
        if order != sorted(order):
            failures.append(f"core/ARCHITECTURE.md: rooms of {folder} are not told from the ground up")


def check_symbols(library, pattern):
    path = os.path.join(build, library)
    if not os.path.exists(path):
        failures.append(f"{library}: not built")
        return
    out = subprocess.run(["nm", "--undefined-only", "--format=posix", path], capture_output=True, text=True)
    for line in out.stdout.splitlines():
        symbol = line.split(" ")[0]
        if re.search(pattern, symbol):
            failures.append(f"{library}: needs {symbol}")


def check_top_level():
    allowed = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "server", "core", "protocol", "clients", "tests",
               "docker"}
    out = subprocess.run(["git", "-C", source, "ls-files"], capture_output=True, text=True)
    for top in sorted({n.split("/")[0] for n in out.stdout.split()}):
        if top not in allowed and not top.startswith("."):
            failures.append(f"{top}: does not belong at the top level")


def check_headers_stand_alone(names):
    """Each header of ours must compile by itself."""
    flags = ["-std=c17", "-fsyntax-only", "-x", "c", "-I", source, "-"]
    compiler = os.environ.get("CC", "cc")
    for name in names:
        if not name.endswith(".h") or name.startswith(("core/accel/embree", "tests/")):
            continue
        out = subprocess.run([compiler, *flags], input=f'#include "{name}"\n', capture_output=True, text=True)
        if out.returncode != 0:
            failures.append(f"{name}: does not compile alone: {out.stderr.strip().splitlines()[0]}")


names = [n for n in tracked_names() if n.endswith((".c", ".h"))]
if not names:
    failures.append("no source files found")
for n in names:
    check_includes(n)
all_includes = {n: includes_of(n) for n in names}
check_cycles(all_includes)
check_plants(all_includes)
check_web_layers()
check_room_tables()
check_sizes(names)
check_paths()
check_notes(names)
check_pages()
for lib, symbols in MUST_NOT_NEED.items():
    check_symbols(lib, symbols)
check_top_level()
check_headers_stand_alone(names)
for failure in failures:
    print(failure)
print(f"{len(names)} files, {len(failures)} violations")
sys.exit(1 if failures else 0)
