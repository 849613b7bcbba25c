"""Parameter objects in compiled functions: numba reads the numbers of a frozen dataclass.

A compiled function that takes an `IcpParameters` gets its numbers, not its texts. numba needs to be
told how the object looks in machine code (a struct of its fields) and how to fill it.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from numba import typeof, types
from numba.core import cgutils
from numba.extending import (
    NativeValue,
    make_attribute_wrapper,
    models,
    register_model,
    typeof_impl,
    unbox,
)


class RecordType(types.Type):  # type: ignore[misc]
    """The numba type of a frozen dataclass: its numbers, each of the type of its default."""

    def __init__(self, record: type) -> None:
        super().__init__(name=f"{record.__module__}.{record.__qualname__}")
        self.record = record

    @property
    def numbers(self) -> list[tuple[str, Any]]:
        """Name and type of each field that holds a number."""
        defaults = {each.name: each.default for each in fields(self.record)}
        return [(k, typeof(v)) for k, v in defaults.items() if isinstance(v, (bool, int, float))]


@register_model(RecordType)
class _Model(models.StructModel):  # type: ignore[misc]
    def __init__(self, manager: Any, record_type: RecordType) -> None:
        super().__init__(manager, record_type, record_type.numbers)


@unbox(RecordType)  # type: ignore[untyped-decorator]
def _unbox(record_type: RecordType, record: Any, context: Any) -> Any:
    """Write the machine code that copies the numbers of a Python object into a struct.

    numba runs it at each call from Python: ``struct.name = record.name`` for every number.
    """
    struct = cgutils.create_struct_proxy(record_type)(context.context, context.builder)
    for name, number_type in record_type.numbers:
        python_number = context.pyapi.object_getattr_string(record, name)
        setattr(struct, name, context.unbox(number_type, python_number).value)
        context.pyapi.decref(python_number)
    has_error = cgutils.is_not_null(context.builder, context.pyapi.err_occurred())
    return NativeValue(struct._getvalue(), is_error=has_error)


def register(record: type) -> None:
    """Let compiled functions take objects of this class."""
    record_type = RecordType(record)
    for name, _ in record_type.numbers:
        make_attribute_wrapper(RecordType, name, name)
    typeof_impl.register(record)(lambda _value, _context: record_type)
