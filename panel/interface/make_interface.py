#!/usr/bin/python3
"""Writes the interface of the operator's page for programs (openapi.json) and for the page itself (interface.ts).

Both come from interface.json beside this and from hal/lcm/*.lcm, whose messages the panel hands on: nothing is typed
twice. --check: writes nothing and fails if one of the two is stale.

In interface.json a field's name ends in ? where it may be missing. A type is number, integer, string or boolean, the
name of another one, a list of the texts that may stand there, or one of these with [] behind it.
"""
import importlib.util
import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
OPENAPI, TYPESCRIPT = HERE / "openapi.json", ROOT / "panel/page/src/interface.ts"
MESSAGES = ["status_t", "motion_t", "tables_t", "alarms_t"]
PLAIN = {"number", "integer", "string", "boolean"}
WHOLE = {"int8_t", "int16_t", "int32_t", "int64_t", "byte"}


def module_of(path):
    """A script of another folder, as a module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


make_messages = module_of(ROOT / "docs/make_messages.py")


def kind_of(kind):
    """The JSON type of a type of LCM."""
    return kind if kind in ("string", "boolean") else "integer" if kind in WHOLE else "number"


def types_of_message(name):
    """The types of an .lcm file as the panel tells it (app/client/message_json.h): a common count makes a list."""
    _, head, fields, _ = make_messages.section(ROOT / "hal/lcm" / f"{name}.lcm")
    counts = {field[:-len("_count")] for field, _, _ in fields if field.endswith("_count")}
    own, lists = {}, {}
    for field, kind, about in fields:
        plain, _, dimension = kind.partition("[")
        dimension = dimension.rstrip("]")
        prefix = dimension.removesuffix("_count")
        if field.removesuffix("_count") in counts and field.endswith("_count"):
            continue
        if dimension and not dimension.isdigit() and field.startswith(prefix + "_"):
            entry = lists.setdefault(prefix, {"about": f"An element of `{prefix}s`.", "fields": {}})
            own.setdefault(prefix + "s", f"{prefix.capitalize()}[]")
            entry["fields"][field[len(prefix) + 1:]] = {"type": kind_of(plain), "about": about}
        elif dimension:
            shape = {"items": kind_of(plain), "about": about}
            own[field] = shape | ({"count": int(dimension)} if dimension.isdigit() else {})
        else:
            own[field] = {"type": kind_of(plain), "about": about}
    types = {prefix.capitalize(): entry for prefix, entry in lists.items()}
    return types | {name.removesuffix("_t").capitalize(): {"about": head, "fields": own}}


def verbs():
    """The verbs of a command, as the page names them."""
    text = (ROOT / "hal/lcm/command_t.lcm").read_text()
    first = text.index("LOAD = 1")
    return [name.lower() for name, _ in re.findall(r"\b([A-Z_]+) = (\d+)", text[first:])]


def all_types():
    """(types by name, the rest of interface.json)."""
    described = json.loads((HERE / "interface.json").read_text())
    types = {}
    for name in MESSAGES:
        types |= types_of_message(name)
    types |= described["types"]
    types["Verb"] = {"enum": verbs(), "about": "Of a command: those of hal/lcm/command_t.lcm."}
    return types, described


# As a JSON schema

def schema(what):
    """The schema of a type, or of a field."""
    if isinstance(what, list):
        return {"enum": what}
    if isinstance(what, str):
        if what.endswith("[]"):
            return {"type": "array", "items": schema(what[:-2])}
        return {"type": what} if what in PLAIN else {"$ref": f"#/components/schemas/{what}"}
    out = {}
    if "fields" in what:
        out = object_schema(what["fields"])
    elif "items" in what:
        out = {"type": "array", "items": schema(what["items"])}
        if "count" in what:
            out |= {"minItems": what["count"], "maxItems": what["count"]}
    elif "one_of" in what:
        out = {"oneOf": [schema(one) for one in what["one_of"]]}
    elif "enum" in what:
        out = {"enum": what["enum"]}
    elif "nullable" in what:
        out = {"oneOf": [schema(what["nullable"]), {"type": "null"}]}
    else:
        out = schema(what["type"])
    return out | ({"description": what["about"]} if what.get("about") else {})


def object_schema(fields):
    return {"type": "object", "properties": {name.rstrip("?"): schema(kind) for name, kind in fields.items()},
            "required": [name for name in fields if not name.endswith("?")], "additionalProperties": False}


def message_schema(name, types, kind):
    """A message of the stream: the type with the field `type`."""
    what = types[kind]
    fields = {"type": [name]} | what["fields"]
    return schema({"about": what["about"], "fields": fields})


def content(kind):
    return {"content": {kind if "/" in kind else "application/json": {"schema": {} if "/" in kind else schema(kind)}}}


def operation(request):
    """One request as OpenAPI wants it."""
    codes = {"200": {"description": "Done."} | content(request["answer"])}
    codes |= {code: {"description": text} | content("text/plain") for code, text in request.get("codes", {}).items()}
    if not request.get("open"):
        codes["401"] = {"description": "No key, or no session."} | content("text/plain")
    out = {"summary": request["about"], "responses": dict(sorted(codes.items()))}
    out["security"] = [] if request.get("open") else [{"key": []}, {"session": []}]
    if "{name}" in request["path"]:
        out["parameters"] = [{"name": "name", "in": "path", "required": True, "schema": {"type": "string"}}]
    if "body" in request:
        out["requestBody"] = {"required": True} | content(request["body"])
    return out


def openapi(types, described):
    schemas = {name: schema(what) for name, what in types.items()}
    for side, title in (("from_server", "ServerMessage"), ("from_page", "PageMessage")):
        names = []
        for name, kind in described[side].items():
            title_of_one = "".join(part.capitalize() for part in name.split("_")) + "Message"
            schemas[title_of_one] = message_schema(name, types, kind)
            names.append(title_of_one)
        schemas[title] = {"oneOf": [schema(name) for name in names]}
    paths = {}
    for request in described["requests"]:
        paths.setdefault(request["path"], {})[request.get("method", "get")] = operation(request)
    return {"openapi": "3.1.0",
            "info": {"title": "Trunnion: the operator's page", "version": "1",
                     "description": "Made by panel/interface/make_interface.py. Lengths in mm, angles in rad, times "
                                    "in s. The WebSocket /api/v1/stream (subprotocol trunnion-1) tells "
                                    "ServerMessage and takes PageMessage; docs/panel.md says how."},
            "paths": paths,
            "components": {"schemas": schemas,
                           "securitySchemes": {
                               "key": {"type": "http", "scheme": "bearer"},
                               "session": {"type": "apiKey", "in": "cookie", "name": "__Host-trunnion-NAME"}}}}


# As TypeScript

def typescript(what):
    """The type's name in TypeScript."""
    if isinstance(what, list):
        return " | ".join(json.dumps(one) for one in what)
    if isinstance(what, str):
        if what.endswith("[]"):
            inner = typescript(what[:-2])
            return f"({inner})[]" if "|" in inner else f"{inner}[]"
        return "number" if what == "integer" else what
    if "items" in what:
        inner, count = typescript(what["items"]), what.get("count", 0)
        many = f"({inner})[]" if "|" in inner else f"{inner}[]"
        return f"[{', '.join([inner] * count)}]" if 0 < count <= 3 else many
    if "one_of" in what:
        return " | ".join(typescript(one) for one in what["one_of"])
    if "enum" in what:
        return typescript(what["enum"])
    if "nullable" in what:
        return typescript(what["nullable"]) + " | null"
    return typescript(what["type"])


def declaration(name, what):
    """The TypeScript text of one type."""
    about = [f"/** {what['about']} */"] if what.get("about") else []
    if "fields" not in what:
        return [*about, f"export type {name} = {typescript(what)};", ""]
    lines = [*about, f"export interface {name} {{"]
    for field, kind in what["fields"].items():
        if isinstance(kind, dict) and kind.get("about"):
            lines.append(f"  /** {kind['about']} */")
        lines.append(f"  {field}: {typescript(kind)};")
    return [*lines, "}", ""]


def page_types(types, described):
    lines = ["// Made by panel/interface/make_interface.py: what the server and the page tell each other.", ""]
    for name, what in types.items():
        lines += declaration(name, what)
    for side, title in (("from_server", "ServerMessage"), ("from_page", "PageMessage")):
        one = [f'({{ type: "{name}" }} & {kind})' for name, kind in described[side].items()]
        lines += [f"export type {title} =", *(f"  | {text}" for text in one)]
        lines[-1] += ";"
        lines.append("")
    return "\n".join(lines[:-1]) + "\n"


def main():
    types, described = all_types()
    texts = {OPENAPI: json.dumps(openapi(types, described), indent=1) + "\n", TYPESCRIPT: page_types(types, described)}
    if "--check" not in sys.argv[1:]:
        for path, text in texts.items():
            path.write_text(text)
        return 0
    stale = [path.relative_to(ROOT) for path, text in texts.items() if not path.exists() or path.read_text() != text]
    for path in stale:
        print(f"{path}:1: stale; run panel/interface/make_interface.py")
    if not stale:
        print(f"{len(types)} types, up to date")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
