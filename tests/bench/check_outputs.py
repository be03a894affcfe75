#!/usr/bin/env python3
"""What a study leaves in a folder can be read: check_outputs.py DIR STUDY BENCH runs lumend-bench, which is BENCH, and looks at it.

SVG is well-formed XML whose coordinates are numbers inside the picture; JSON and CSV hold the same rows."""
import csv
import json
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as ET

FILES = {
    "rays": {"rays"},
    "stream": {"stream"},
    "stride": {"stride", "stride-primary", "stride-both", "stride-secondary", "stride-speedup"},
    "accuracy": {"accuracy", "accuracy-break-even", "accuracy-desk", "accuracy-desk-chart"},
    "errors": {"errors"},
    "budgets": {"budgets"},
    "codecs": {"codecs"},
    "drag": {"drag", "drag-frames"},
    "effects": {"effects", "effects-bars", "effects-left-out", "effects-subsets"},
    "instant": {"instant", "instant-speedup", "instant-cornell", "instant-wobble"},
    "growth": {"growth"},
    "irrcache": {"irrcache", "irrcache-turns", "irrcache-turn-cornell", "irrcache-speedup", "irrcache-lookups",
                 "irrcache-lookups-table"},
    "truth": {"truth", "truth-first", "truth-effects"},
    "rest": {"rest"},
    "settings": {"settings"},
    "vision": {"vision"},
    "video": {"video"},
    "viewers": {"viewers", "viewers-memory", "viewers-rays", "viewers-time"},
    "ais": {"ais", "ais-speedup", "ais-budget", "ais-cornell", "ais-cornell-media", "ais-desk",
            "ais-desk-no-gloss"},
}


def check_svg(path):
    root = ET.parse(path).getroot()
    width, height = float(root.get("width")), float(root.get("height"))
    texts = " ".join(element.text or "" for element in root.iter())
    assert "--quick" in texts, f"{path} does not say that --quick made it"
    if path.stem == "effects-bars":
        assert "CPU time of all threads together, ms" in texts, f"{path}: no name on the axis"
    n_lines = 0
    for element in root.iter():
        for name in ("x", "y", "cx", "cy", "r"):
            assert 0 <= float(element.get(name, 0)) <= max(width, height), f"{path}: {name} is {element.get(name)}"
        d = element.get("d", "")
        assert "nan" not in d and "inf" not in d, f"{path}: {d}"
        absolute = re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", d)
        assert all(0 <= float(x) <= width and 0 <= float(y) <= height for x, y in absolute), f"{path}: {d}"
        n_lines += len(absolute) > 2 or (element.tag.endswith("rect") and len(element) > 0)  # a bar with its title
    assert n_lines > 0, f"{path} shows no curve and no bar"


def check_table(base):
    rows = json.loads(base.with_suffix(".json").read_text())
    with base.with_suffix(".csv").open(newline="") as f:
        table = list(csv.DictReader(f))
    assert rows and len(rows) == len(table), f"{base}: {len(rows)} rows in JSON, {len(table)} in CSV"
    for row, line in zip(rows, table):
        assert row.keys() == line.keys() and None not in line.values(), f"{base}: {line}"
        for key, value in row.items():
            same = line[key] == "" if value is None else line[key] == value or float(line[key]) == value
            assert same, f"{base}: {key} is {value} in JSON, {line[key]} in CSV"


def check_truth(folder):
    rows = json.loads((folder / "truth.json").read_text())
    for row in rows:
        assert 0 < row["p5"] <= row["median"] <= row["p95"] <= row["highest"], row
        # a picture of path is right but for its noise, and that of its reference: five standard errors of a mean,
        # which is known to a factor of two from pixels with outliers
        if row["method"] == "path":
            noise = row["stderr_mean"] * (1 + row["reference_spp"] / row["spp"]) ** 0.5
            assert abs(row["mean"] - 1) < 10 * noise, row
    page = (folder / "truth.html").read_text()
    pictures = re.findall(r'<img[^>]* src="([^"]*)"', page)
    assert len(pictures) > 10 and "--quick" in page, f"{len(pictures)} pictures on the page"
    for name in pictures:
        assert (folder / name).read_bytes()[1:4] == b"PNG", f"{name} is no picture"


def main():
    folder, study, bench = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    for name in FILES[study]:  # not those of a run before
        for left in folder.glob(f"{name}.*"):
            left.unlink()
    subprocess.run([bench, study, "--quick", "--out", folder], check=True)
    for name in sorted(FILES[study]):
        base = folder / name
        if base.with_suffix(".svg").exists():
            check_svg(base.with_suffix(".svg"))
        else:
            check_table(base)
        print("ok", name)
    if study == "truth":
        check_truth(folder)


if __name__ == "__main__":
    main()
