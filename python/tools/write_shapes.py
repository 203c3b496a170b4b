"""Writes `python/obsdeg/shapes.py`: the answers as typed classes, from the JSON Schemas that the program
prints.

    python python/tools/write_shapes.py [PROGRAM]
"""

from __future__ import annotations

import json
import keyword
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
#: Schemas of answers; the first schema with a type of some name defines it.
SCHEMAS = [
    "analysis",
    "system",
    "comparison",
    "design",
    "walks",
    "sensors",
    "next",
    "part",
    "simulation",
    "system-run",
    "crosscheck",
    "system-evidence",
    "calibration",
    "system-calibration",
    "procedure",
    "allan",
    "audit",
]
HEAD = '''"""Types of answers: a class for each type of JSON. Written by `python/tools/write_shapes.py`, not by hand."""

from __future__ import annotations

from typing import Literal, Union

from ._records import Record, Shape
'''
Schema = dict[str, Any]


def camel(word: str) -> str:
    """Name of a class from words such as `not_settled`."""
    return "".join(w[:1].upper() + w[1:] for w in word.replace("-", "_").split("_"))


def doc(text: str, indent: str) -> list[str]:
    """Description as a docstring."""
    text = " ".join(text.split()).replace("\\", "\\\\").replace('"', "'") or "As in the JSON."
    lines = textwrap.wrap(text, 140 - len(indent) - 6)
    if len(lines) == 1:
        return [f'{indent}"""{lines[0]}"""']
    return [f'{indent}"""{lines[0]}', *(indent + line for line in lines[1:]), f'{indent}"""']


class Writer:
    """Classes in an order in which each follows those that it uses."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.known: dict[str, Any] = {}
        self.names: dict[str, str] = {}

    def schema(self, kind: str, schema: Schema) -> None:
        """Defines the types of an answer."""
        title, defs = schema["title"], schema.get("$defs", {})
        self.names = {}

        def whole(value: Any) -> Any:
            """Schema with referenced types inserted, so that equal texts are equal types."""
            if isinstance(value, dict):
                if "$ref" in value:
                    name = value["$ref"].rsplit("/", 1)[1]
                    return {"type": name, "is": whole(defs[name])}
                return {k: whole(v) for k, v in value.items() if k not in ("description", "default")}
            return [whole(v) for v in value] if isinstance(value, list) else value

        def order(value: Any, seen: list[str]) -> list[str]:
            if isinstance(value, dict):
                for k, v in value.items():
                    if k == "$ref":
                        name = v.rsplit("/", 1)[1]
                        order(defs[name], seen)
                        seen.append(name)
                    elif k != "$defs":
                        order(v, seen)
            elif isinstance(value, list):
                for v in value:
                    order(v, seen)
            return seen

        for name in dict.fromkeys(order(schema, [])):
            mine, expanded = name, whole(defs[name])
            if self.known.get(name, expanded) != expanded or name in TITLES:
                mine = f"{title}{name}"
            self.names[name] = mine
            if self.known.get(mine) is None:
                self.known[mine] = expanded
                self.define(mine, defs[name])
        self.fields(title, "Shape", schema, f"The JSON of `obsdeg schema {kind}`.")

    def define(self, name: str, schema: Schema) -> None:
        """Defines a type with a name."""
        variants = schema.get("oneOf") or schema.get("anyOf")
        if schema.get("type") == "object":
            self.fields(name, "Record", schema)
        elif variants:
            texts = [f'"{v["const"]}"' for v in variants if "const" in v]
            texts += [json.dumps(e) for v in variants for e in v.get("enum", [])]
            types = [f"Literal[{', '.join(texts)}]"] if texts else []
            for v in variants:
                if v.get("type") == "object":
                    tag = v["properties"].get("kind", {}).get("const") or next(iter(v["properties"]))
                    self.fields(name + camel(tag), "Record", v)
                    types.append(name + camel(tag))
                elif "const" not in v and "enum" not in v:
                    types.append(self.type(v))
            about = schema.get("description", "")
            meanings = [f"{v['const']}: {v['description']}" for v in variants if "const" in v and "description" in v]
            self.alias(name, types, " ".join([about, *meanings]))
        else:
            self.alias(name, [self.type(schema)], schema.get("description", ""))

    def alias(self, name: str, types: list[str], about: str) -> None:
        """Defines a name for a type."""
        joined = types[0] if len(types) == 1 else f"Union[{', '.join(types)}]"
        if len(joined) + len(name) > 130:
            inside = ",\n    ".join(joined[joined.index("[") + 1 : -1].split(", "))
            joined = f"{joined[: joined.index('[')]}[\n    {inside},\n]"
        self.lines += ["", f"{name} = {joined}", *doc(about, "")]

    def fields(self, name: str, base: str, schema: Schema, about: str = "") -> None:
        """Defines the class of an object."""
        self.lines += ["", "", f"class {name}({base}):", *doc(schema.get("description") or about, "    "), ""]
        if base == "Record":
            self.lines += ["    __slots__ = ()", ""]
        required = schema.get("required", [])
        for field, of in schema.get("properties", {}).items():
            kind = self.type(of)
            if field not in required and not kind.startswith("list[") and not kind.endswith("| None"):
                kind += " | None"
            self.lines.append(f"    {field + '_' if keyword.iskeyword(field) else field}: {kind}")
            if "description" in of:
                self.lines += doc(of["description"], "    ")
        if not schema.get("properties"):
            self.lines.pop()

    def type(self, of: Schema) -> str:
        """Type in the notation of Python."""
        if "$ref" in of:
            return self.names[of["$ref"].rsplit("/", 1)[1]]
        if "const" in of:
            return f"Literal[{json.dumps(of['const'])}]"
        if "enum" in of:
            return f"Literal[{', '.join(json.dumps(e) for e in of['enum'])}]"
        if "anyOf" in of:
            return " | ".join(self.type(v) for v in of["anyOf"])
        kind = of.get("type")
        if isinstance(kind, list):
            return " | ".join(self.type({**of, "type": k}) for k in kind)
        if kind == "array" and "prefixItems" in of:
            return f"tuple[{', '.join(self.type(v) for v in of['prefixItems'])}]"
        if kind == "array" and of.get("minItems") is not None and of.get("minItems") == of.get("maxItems"):
            return f"tuple[{', '.join([self.type(of['items'])] * of['minItems'])}]"
        if kind == "array":
            return f"list[{self.type(of['items'])}]"
        if kind == "object" and isinstance(of.get("additionalProperties"), dict):
            return f"dict[str, {self.type(of['additionalProperties'])}]"
        known = {"string": "str", "integer": "int", "number": "float", "boolean": "bool", "null": "None"}
        if kind not in known:
            raise ValueError(f"no type in Python for {json.dumps(of)}")
        return known[str(kind)]


#: Names of the answers themselves.
TITLES: set[str] = set()


def written(program: str) -> str:
    """Text of the module."""
    schemas = {}
    for kind in SCHEMAS:
        done = subprocess.run([program, "schema", kind], capture_output=True, text=True, check=True)
        schemas[kind] = json.loads(done.stdout)
    TITLES.update(s["title"] for s in schemas.values())
    writer = Writer()
    for kind, schema in schemas.items():
        writer.schema(kind, schema)
    return HEAD + "\n".join(writer.lines) + "\n"


if __name__ == "__main__":
    program = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "target" / "debug" / "obsdeg")
    (ROOT / "python" / "obsdeg" / "shapes.py").write_text(written(program), encoding="utf-8")
