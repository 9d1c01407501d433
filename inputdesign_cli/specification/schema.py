"""The JSON schema of a spec, for editors that complete and check YAML."""

from __future__ import annotations

from inputdesign_cli.specification.models.spec import OF_DESIGNS, Spec
from inputdesign_cli.specification.yaml.overrides import KEY
from inputdesign_cli.specification.yaml.plain import Plain
from inputdesign_cli.version import __version__


def json_schema() -> dict[str, Plain]:
    """The schema (draft 2020-12) of a spec file: keys, types, choices and descriptions.

    What spans several keys (shapes, stability, contradictions) is left to `idesign validate`.
    """
    schema = _tidy(Spec.model_json_schema())
    names = {"type": "string", "minLength": 1}
    schema["properties"][KEY] = {
        "description": "Files whose blocks stand where the spec has none, such as model.yaml of `identify`.",
        "anyOf": [names, {"type": "array", "items": names, "minItems": 1}],
    }
    schema.pop("required")
    variance = {"noise": {"required": schema["$defs"]["Noise"].pop("required")}}
    schema["anyOf"] = [
        {"required": ["plant", "noise"], "properties": variance},
        {"required": [KEY]},
        # Only to be estimated from: the noise is estimated as well.
        {"required": ["plant"], "properties": {key: {"not": {}} for key in OF_DESIGNS}},
    ]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:inputdesign-cli:spec:{__version__}",
        "title": "idesign experiment design",
        **{key: value for key, value in schema.items() if key != "title"},
    }


def _tidy(node: Plain) -> Plain:
    """Without what pydantic adds for Python alone.

    That is null for absent keys, class names as titles, and defaults that are whole sections.
    """
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = {
        key: _tidy(value)
        for key, value in node.items()
        if not (key == "title" and isinstance(value, str))
        and not (key == "default" and (value is None or isinstance(value, dict)))
    }
    options = kept.get("anyOf")
    if isinstance(options, list):
        kept["anyOf"] = [option for option in options if option != {"type": "null"}]
        if len(kept["anyOf"]) == 1:
            kept = {**kept.pop("anyOf")[0], **kept}
    return kept
