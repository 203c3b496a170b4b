#!/usr/bin/env python3
"""Figures of the code: python3 tools/code_figures.py [CHECKOUT]

Prints, for Rust outside tests: functions of more than 60 lines, names of types that stand for several things, public
items of each crate, files of more than 500 lines, lines; and descriptions of the published schemas of fewer than 26
characters.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

VISIBLE = r"(?:pub(?:\([^)]*\))? )?"
FUNCTION = re.compile(rf"^(\s*){VISIBLE}(?:const |async |unsafe )*fn (\w+)")
TYPE = re.compile(rf"^\s*{VISIBLE}(?:struct|enum|trait) (\w+)", re.MULTILINE)
PUBLIC = re.compile(r"^\s*pub (?:const |async |unsafe )*(?:fn|struct|enum|trait|type|static|const) \w+", re.MULTILINE)


def functions(text: str) -> Iterator[tuple[int, str]]:
    """Lines and name of every function with a body."""
    lines = text.splitlines()
    for first, line in enumerate(lines):
        if head := FUNCTION.match(line):
            for last in range(first, len(lines)):
                if lines[last].startswith(head[1] + "}"):
                    yield last - first + 1, head[2]
                    break
                own = lines[last].startswith(head[1]) and not lines[last].startswith(head[1] + " ")
                if own and last > first and lines[last].endswith(";"):
                    break


def descriptions(schema: Any) -> Iterator[str]:
    """Descriptions in a schema."""
    if isinstance(schema, dict):
        if isinstance(schema.get("description"), str):
            yield schema["description"]
        schema = list(schema.values())
    if isinstance(schema, list):
        for part in schema:
            yield from descriptions(part)


def main() -> None:
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parents[1])
    texts = {
        file.relative_to(root): file.read_text(encoding="utf-8")
        for folder in ("crates/*/src", "crates/cli", "crates/library")
        for file in root.glob(f"{folder}/**/*.rs")
        if not file.stem.endswith("tests")
    }
    code = {file: text.split("#[cfg(test)]")[0] for file, text in texts.items()}
    sizes = ((n, name, file) for file, text in code.items() for n, name in functions(text))
    long = sorted((found for found in sizes if found[0] > 60), reverse=True)
    print("functions of more than 60 lines:", *(f"{n} {name} ({file})" for n, name, file in long), sep="\n  ")
    places: dict[str, set[str]] = defaultdict(set)
    for file, text in code.items():
        for name in TYPE.findall(text):
            places[name].add(str(file))
    print("names of types in several files:", sum(len(found) > 1 for found in places.values()))
    public = Counter[str]()
    for file, text in code.items():
        public[file.parts[1]] += len(PUBLIC.findall(text))
    print("public items:", public.total(), dict(public.most_common()))
    schemas = [json.loads(file.read_text(encoding="utf-8")) for file in root.glob("schemas/*.json")]
    said = [text for schema in schemas for text in descriptions(schema)]
    print(f"descriptions in schemas: {len(said)}, {sum(len(text) < 26 for text in said)} of fewer than 26 characters")
    print("files of more than 500 lines:", sum(text.count("\n") > 500 for text in texts.values()))
    print("lines:", sum(text.count("\n") for text in texts.values()))


if __name__ == "__main__":
    main()
