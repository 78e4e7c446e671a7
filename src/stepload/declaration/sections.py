"""Sections of a plan: dataclasses of pydantic, from whose fields reader, schema and tables follow.

::

    hold_s: Annotated[Duration, key("How long each level is held.")] = 3.0

is the key `hold`, a time, 3 s where it is left out. The key is the name of the field without its
unit, or the alias. A field without default is required; one with the default `DERIVED` follows from
others once they are read. `INTERNAL` marks a field that no file may write.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import cache
from typing import Annotated, Any, NoReturn, get_args, get_origin

from pydantic import ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter
from pydantic.fields import FieldInfo
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import PydanticCustomError, PydanticOmit, PydanticUndefined, core_schema

from stepload.declaration.quantities import WRITTEN

Kind = Any
"""A section class."""

_UNIT = re.compile(
    "_(n_per_m|n_s_per_m|n_per_s|m_per_n|rad_per_n|n_m_per_rad|per_k|m_s2|m_s|n_m|rad|hz|kg|pa|n|m"
    "|s|c|k)$"
)


def key_of(field: str) -> str:
    """The key of a field: its name without the unit."""
    return _UNIT.sub("", field)


LIST = "a list, each "
SECTION = ConfigDict(
    extra="forbid",
    alias_generator=key_of,
    validate_by_name=True,
    validate_by_alias=True,
    serialize_by_alias=True,
    arbitrary_types_allowed=True,
    defer_build=True,
)
"""How every section is validated."""


def key(meaning: str, *, alias: str | None = None) -> Any:
    """What makes a field a key: what it means, and how it is written where not as the field."""
    return Field(description=meaning, alias=alias)


class UnknownError(AttributeError):
    """A value was used that the plan leaves out, or that is bad."""


class _Unknown:
    """Stands where there is no value; whoever computes with it, or asks it, ends there."""

    def __init__(self, why: str) -> None:
        self.__why = why

    def __repr__(self) -> str:
        return f"<{self.__why}>"

    def _fail(self, *_: object) -> NoReturn:
        raise UnknownError(self.__why)

    __getattr__ = __iter__ = __len__ = __bool__ = __float__ = __getitem__ = __format__ = _fail
    __lt__ = __le__ = __gt__ = __ge__ = __add__ = __radd__ = __sub__ = __rsub__ = _fail
    __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __neg__ = __abs__ = __pow__ = _fail
    __fspath__ = __contains__ = _fail
    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other or self._fail()

    def __copy__(self) -> _Unknown:
        return self

    def __deepcopy__(self, memo: object) -> _Unknown:
        return self


DERIVED: Any = _Unknown("derived")
"""Default of a field that follows from others."""
UNKNOWN: Any = _Unknown("bad")
"""Value of a field whose value in the file is bad, so that a problem hides no other."""


def written(value: Any) -> Any:
    """A value as the plan gives it; None where it leaves it out.

    Raises:
        UnknownError: it is bad.
    """
    if value is UNKNOWN:
        raise UnknownError("bad")
    return None if value is DERIVED else value


def known(*values: Any) -> tuple[Any, ...]:
    """The values, all of which must be known.

    Raises:
        UnknownError: one is not.
    """
    if any(value is UNKNOWN or value is DERIVED for value in values):
        raise UnknownError("bad or left out")
    return values


def put(section: object, field: str, value: object) -> None:
    """Set a field of a section that is still being read."""
    object.__setattr__(section, field, value)


class _Internal:
    """Marks a field that code fills in: a file that writes its key has an unknown key."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        def read(value: Any, info: Any) -> Any:
            if info.context == WRITTEN:
                raise PydanticCustomError("unexpected_keyword_argument", "no key")
            return value

        return core_schema.with_info_plain_validator_function(read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> NoReturn:
        raise PydanticOmit


INTERNAL = _Internal()


@dataclass(frozen=True, slots=True)
class Made:
    """Marks a field that holds an object of another room, made from a section with `made()`.

    `sections` is a section class or a union of several that the key `shape` tells apart.
    """

    sections: Any

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        def read(value: Any, inner: Callable[[Any], Any], info: Any) -> Any:
            if info.context != WRITTEN:
                return value
            return inner(value).made()

        return core_schema.with_info_wrap_validator_function(
            read, handler.generate_schema(self.sections)
        )


class _JsonSchema(GenerateJsonSchema):
    """A field that follows from others has no default to write."""

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        if schema.get("default") is DERIVED:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)


def schema_of(hint: Any) -> dict[str, Any]:
    """JSON Schema of what may be written where this hint stands."""
    return adapter(hint).json_schema(by_alias=True, schema_generator=_JsonSchema)


def fields_of(kind: Kind) -> Mapping[str, FieldInfo]:
    """The fields of a section by their names, those that no file may write among them."""
    found: Mapping[str, FieldInfo] = kind.__pydantic_fields__
    return found


@cache
def adapter(kind: Any) -> TypeAdapter[Any]:
    """The validator of a section."""
    made: TypeAdapter[Any] = TypeAdapter(kind)
    made.rebuild(raise_errors=True)
    return made


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a section: its name, the field it becomes, and the sections that may stand there.

    `each`: a list is written, `sections` has more than one entry where `shape` tells them apart.
    """

    name: str
    field: str
    info: FieldInfo
    sections: tuple[Kind, ...]
    each: bool

    @property
    def meaning(self) -> str:
        return self.info.description or ""

    @property
    def derived(self) -> bool:
        return self.info.default is DERIVED

    @property
    def required(self) -> bool:
        return self.info.is_required()

    @property
    def hint(self) -> Any:
        """The annotation of the field, with what pydantic knows of it."""
        notes = self.info.metadata
        return Annotated[(self.info.annotation, *notes)] if notes else self.info.annotation

    @property
    def shaped(self) -> bool:
        """Whether the key `shape` tells which of several sections stands there."""
        return len(self.sections) > 1

    @property
    def is_text(self) -> bool:
        """Whether a text is written there, which a file may have to quote."""
        return self.info.annotation is str

    @property
    def is_section(self) -> bool:
        """Whether the field holds the one section that may stand there."""
        return bool(self.sections) and not any(isinstance(n, Made) for n in self.info.metadata)

    @property
    def expected(self) -> str:
        """What may be written, in words; "" of a section."""
        return "" if self.sections else expected(schema_of(self.hint))

    @property
    def each_expected(self) -> str:
        """What each item of a list may be, in words."""
        return self.expected.removeprefix(LIST)

    @property
    def default_text(self) -> str | bool | int | float | None:
        """The default as a plan would write it; None where there is none to write."""
        default = self.info.default
        if self.derived or default in (None, PydanticUndefined) or self.sections:
            return None
        shown = adapter(self.hint).dump_python(default, mode="json")
        return shown if isinstance(shown, (str, bool, int, float)) else None


@cache
def keys(kind: Kind) -> tuple[Key, ...]:
    """The keys of a section, in the order of their declaration."""
    return tuple(
        Key(info.alias or key_of(name), name, info, *_content(info))
        for name, info in fields_of(kind).items()
        if not any(note is INTERNAL for note in info.metadata)
    )


def _content(info: FieldInfo) -> tuple[tuple[Kind, ...], bool]:
    if made := next((note for note in info.metadata if isinstance(note, Made)), None):
        return _kinds(made.sections), False
    return _kinds(info.annotation), _is_list(info.annotation)


def _is_list(hint: Any) -> bool:
    return get_origin(hint) is tuple


def _kinds(hint: Any) -> tuple[Kind, ...]:
    """The section classes in a hint."""
    if is_dataclass(hint) and hasattr(hint, "__pydantic_fields__"):
        assert isinstance(hint, type)
        return (hint,)
    if get_origin(hint) is tuple:
        return ()
    if get_origin(hint) is Annotated and (
        made := next((note for note in hint.__metadata__ if isinstance(note, Made)), None)
    ):
        return _kinds(made.sections)
    return tuple(kind for inner in get_args(hint) for kind in _kinds(inner))


def sections_below(kind: Kind) -> tuple[Kind, ...]:
    """`kind` and every section in it, depth first, each once."""
    seen: dict[Kind, None] = {}

    def visit(found: Kind) -> None:
        if found not in seen:
            seen[found] = None
            for each in keys(found):
                for inner in each.sections:
                    visit(inner)

    visit(kind)
    return tuple(seen)


def keys_below(kind: Kind, path: str = "") -> Iterator[tuple[str, Key]]:
    """Every key in a section and in those below it, with its dotted path."""
    for each in keys(kind):
        here = f"{path}{each.name}"
        yield here, each
        for inner in each.sections:
            yield from keys_below(inner, f"{here}.")


def expected(schema: Mapping[str, Any]) -> str:
    """What a JSON Schema allows, in words."""
    if "x-expected" in schema:
        return str(schema["x-expected"])
    if options := schema.get("anyOf"):
        return expected(next(each for each in options if each.get("type") != "null"))
    if "$ref" in schema:
        return expected(schema["$defs"][schema["$ref"].rpartition("/")[2]])
    if "enum" in schema:
        return "one of " + ", ".join(str(word) for word in schema["enum"] if word)
    if "const" in schema:
        return f"`{schema['const']}`"
    match schema.get("type"):
        case "array":
            return LIST + expected(schema["items"])
        case "boolean":
            return "true or false"
        case "integer" | "number":
            return _number(schema)
        case "string" if "format" in schema:
            return {"date": "a date, year-month-day", "path": "a path of at most 400 characters"}[
                schema["format"]
            ]
        case "string":
            noun = "a text" if schema.get("maxLength", 0) > 1_000 else "a text of one line"
            return f"{noun} of at most {schema.get('maxLength')} characters"
    return "a mapping"


def _number(schema: Mapping[str, Any]) -> str:
    noun = "a whole number" if schema["type"] == "integer" else "a plain number"
    low, above = schema.get("minimum"), schema.get("exclusiveMinimum")
    least = "" if low is None else f" from {low:g}"
    least = least if above is None else f" above {above:g} up"
    most = f" to {schema['maximum']:g}" if "maximum" in schema else ""
    return f"{noun}{least}{most}"
