"""Results as frozen dataclasses that are read from, and give back, what the commands write with `--json`."""

from __future__ import annotations

import dataclasses
import functools
import math
import types
import typing
from typing import Any, Self

from . import _html


@dataclasses.dataclass(frozen=True)
class Result:
    """A result. `to_dict` is, field for field, what the command of the same name writes with `--json`."""

    @classmethod
    def from_dict(cls, values: dict[str, Any], **more: Any) -> Self:
        """Reads what `to_dict` gives; `more` are the fields that are not in it."""
        hints = _hints(typing.cast(Any, cls))
        read = {_field(key): _read(hints[_field(key)], value) for key, value in values.items()}
        return cls(**read, **more)

    def to_dict(self) -> dict[str, Any]:
        """The same in dicts, lists, numbers, texts and None; numbers that are not finite are None."""
        values: dict[str, Any] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            # Fields that hold arrays or models are not in the JSON; some are omitted if they are None.
            if field.metadata.get("json", True) and not (value is None and field.metadata.get("optional", False)):
                values[field.name.removesuffix("_")] = _written(value)
        return values

    def _repr_html_(self) -> str:
        return _html.page(type(self).__name__, _html.table(("", "value"), self.to_dict().items()))


@dataclasses.dataclass(frozen=True, eq=False)
class Series:
    """A result with arrays, of which `to_dict` makes no copies."""

    def to_dict(self) -> dict[str, Any]:
        """The fields by name; arrays stay arrays, models and recordings become dicts."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {name: value.to_dict() if hasattr(value, "to_dict") else value for name, value in values.items()}

    def _repr_html_(self) -> str:
        values: dict[str, Any] = {}
        for name, value in self.to_dict().items():
            if isinstance(value, dict):
                parts = typing.cast("dict[str, Any]", value)
                values |= {f"{name}: {key}": part for key, part in parts.items()}
            else:
                values[name] = value
        return _html.page(type(self).__name__, _html.table(("", "value, or lowest and highest"), map(_shown, values.items())))


def _shown(item: tuple[str, Any]) -> tuple[str, object]:
    name, value = item
    return name, (float(value.min()), float(value.max())) if getattr(value, "size", 0) else value


def beside_json() -> Any:
    """A field that is not in the JSON."""
    return dataclasses.field(metadata={"json": False}, repr=False, compare=False)


def left_out_if_none() -> Any:
    """A field that is not in the JSON if it is None."""
    return dataclasses.field(default=None, metadata={"optional": True})


def _field(key: str) -> str:
    return "from_" if key == "from" else key


@functools.cache
def _hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _read(hint: Any, value: Any) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is types.UnionType or origin is typing.Union:
        if value is None and type(None) in arguments:
            return None
        inner = [argument for argument in arguments if argument is not type(None)]
        if len(inner) == 1:
            return _read(inner[0], value)
        return tuple(value) if _is_list(value) else value
    if origin is tuple:
        if arguments[1:] == (...,):
            return tuple(_read(arguments[0], item) for item in value)
        return tuple(_read(argument, item) for argument, item in zip(arguments, value, strict=True))
    if origin is dict:
        return {key: _read(arguments[1], item) for key, item in value.items()}
    if isinstance(hint, type) and issubclass(hint, Result):
        return hint.from_dict(value)
    # JSON has no NaN and no infinity.
    return math.nan if value is None and hint is float else value


def _is_list(value: Any) -> typing.TypeGuard[list[Any]]:
    return isinstance(value, list)


def _written(value: Any) -> Any:
    match value:
        case Result():
            return value.to_dict()
        case tuple() | list():
            return [_written(item) for item in typing.cast("list[Any]", value)]
        case dict():
            return {key: _written(item) for key, item in typing.cast("dict[str, Any]", value).items()}
        case float() if not math.isfinite(value):
            return None
        case _:
            return value
