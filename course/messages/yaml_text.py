"""Plain data as the text that people type and read (YAML), and as JSON for a browser."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import yaml

_EXACT = 2**53  # whole numbers up to here are exact in a browser (ECMAScript, MAX_SAFE_INTEGER)

_NUMBERS = (
    ("int", r"[-+]?(?:0b[01_]+|0x[0-9a-fA-F_]+|0o[0-7_]+|0[0-7_]*|[1-9][0-9_]*)"),
    ("float", r"[-+]?(?:[0-9][0-9_]*\.[0-9_]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"),
    ("float", r"[-+]?[0-9][0-9_]*[eE][-+]?[0-9]+"),
    ("float", r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"),
)
_RULES = [
    (f"tag:yaml.org,2002:{kind}", re.compile(f"^(?:{pattern})$")) for kind, pattern in _NUMBERS
]
_OTHERS = {
    first: [rule for rule in rules if rule[0].rpartition(":")[2] in ("bool", "null", "merge")]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


class _Loader(yaml.SafeLoader):
    """Reads numbers as YAML 1.2 does, and no dates.

    YAML 1.1 takes ``1e-3`` for a text, ``10:30`` for 630 and ``2026-01-31`` for a date.
    """

    yaml_implicit_resolvers = {  # noqa: RUF012 - as PyYAML declares it
        first: [*_OTHERS.get(first, ()), *(_RULES if first in "-+.0123456789" else ())]
        for first in {*_OTHERS, *"-+.0123456789"}
    }


class _Dumper(yaml.SafeDumper):
    """Writes what `_Loader` reads: a text that looks like a number is quoted."""

    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers

    def ignore_aliases(self, data: Any) -> bool:
        """Write what occurs twice twice: people type and read no anchors."""
        return True


def _construct_float(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    value: float = loader.construct_yaml_float(node)
    if math.isinf(value) and "inf" not in node.value.lower():
        raise ValueError(f"{node.value[:20]} is more than a float64 can hold")
    return value


_Loader.add_constructor("tag:yaml.org,2002:float", _construct_float)


def parse_yaml(text: str) -> Any:
    """Return the plain data of a text in YAML, or in JSON.

    Raises:
        ValueError: it is neither; the message is the reason, a phrase.
    """
    try:
        return yaml.load(text, _Loader)  # a SafeLoader that knows fewer types
    except yaml.YAMLError as error:
        raise ValueError(str(error).splitlines()[0].rstrip(".:")) from None
    except ValueError as error:
        raise ValueError(str(error).partition(";")[0]) from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except Exception:  # noqa: BLE001 - "!!bool x" is a KeyError, "!!timestamp x" an AttributeError
        raise ValueError("a tag and its value do not go together") from None


def one_line(data: Any) -> str:
    """Return plain data as one line of YAML."""
    text: str = yaml.dump(
        data, Dumper=_Dumper, default_flow_style=True, width=math.inf, sort_keys=False,
        allow_unicode=True,
    )  # fmt: skip
    return text.strip().removesuffix("\n...")


def to_lines(data: Any) -> str:
    """Return plain data as YAML, a line a field; it ends with the end of a line."""
    text: str = yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    return text


def for_json(data: Any) -> Any:
    """Return plain data as JSON and a browser can hold it.

    What they cannot (infinity, nan, whole numbers of more than 53 bits) becomes its text.
    """
    if isinstance(data, Mapping):
        return {key: for_json(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [for_json(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return one_line(data)
    return one_line(data) if isinstance(data, int) and abs(data) > _EXACT else data


def short_repr(value: Any, longest: int = 60) -> str:
    """Return any value as a sentence can name it, cut where it gets too long."""
    try:
        text = repr(value)
    except Exception:  # noqa: BLE001 - a number of thousands of digits, an object that is broken
        return f"a {type(value).__name__}"
    return text if len(text) <= longest else f"{text[:longest]}…"


def format_count(number: int, what: str) -> str:
    """Return a number of things in words: "1 node", "2 nodes"."""
    return f"{number} {what}{'' if number == 1 else 's'}"
