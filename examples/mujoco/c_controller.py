"""The controller in C99 of a model: emitted, compiled by the system's C compiler, and loaded through ctypes with the names of
the crate's Python binding."""

import ctypes
import json
import re
import subprocess
import types

from romc_controller import emitted


def build(model, folder, romc):
    """Emits and compiles the controller of a model file; returns its folder."""
    header = emitted(model, "controller-c", folder, romc, "_controller.h")
    crate, name = header.parent, header.stem.removesuffix("_controller")
    sources = [f"{name}_controller.c", f"{name}.c"]
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, *sources, "-lm", "-o", "libcontroller.so"], check=True, cwd=crate)
    with open(model, encoding="utf-8") as file:
        sizes = {f"{name.upper()}_LATENT_DIM": json.load(file)["latent_dim"]}
    structs = {of: _fields(header.read_text(), f"{name}_{of}") for of in ("controller_settings", "command")}
    (crate / "binding.json").write_text(json.dumps({"name": name, "sizes": sizes, **structs}))
    return crate


def _fields(header, struct):
    """Type, name and length, None or a number or its name, of each field of a struct in the header."""
    (body,) = re.findall(r"typedef struct \{([^}]*)\} " + struct + ";", header)
    return re.findall(r"^ *(double|int32_t) (\w+)(?:\[(\w+)\])?;", body, re.MULTILINE)


def load(crate):
    """The interface of the crate's own Python module: `Library().default_settings()` and `Controller(settings)`."""
    facts = json.loads((crate / "binding.json").read_text())
    library = ctypes.CDLL(str(crate / "libcontroller.so"))
    prefix, number = facts["name"] + "_controller_", ctypes.c_double

    def fields(struct):
        for kind, name, length in facts[struct]:
            of = {"double": number, "int32_t": ctypes.c_int32}[kind]
            yield name, of * (facts["sizes"].get(length) or int(length)) if length else of

    class Settings(ctypes.Structure):
        _fields_ = list(fields("controller_settings"))

    class Command(ctypes.Structure):
        _fields_ = list(fields("command"))
        solve_us = 0.0

    def function(name, result, *arguments):
        found = getattr(library, prefix + name)
        found.restype, found.argtypes = result, arguments
        return found

    default_settings = function("settings_default", Settings)
    pointer = ctypes.c_void_p
    init = function("init", ctypes.c_int, pointer, ctypes.POINTER(Settings))
    set_reference = function(
        "set_reference", ctypes.c_int, pointer, ctypes.c_size_t, *[pointer] * 5
    )
    step = function(
        "step", ctypes.c_int, pointer, number, pointer, pointer, pointer, ctypes.POINTER(Command)
    )
    status_text = function("status_text", ctypes.c_char_p, ctypes.c_int32)

    class Controller:
        """One controller; it keeps the arrays of its reference."""

        def __init__(self, settings):
            # The size that the header states is its own secret here: more than any model needs.
            self._memory = ctypes.create_string_buffer(1 << 22)
            self._check(init(self._memory, ctypes.byref(settings)))
            self._reference = None

        def set_reference(self, time_s, x, dx, u, feet):
            arrays = [_array(values, number) for values in (time_s, x, dx)]
            arrays.append(None if u is None else _array(u, number))
            arrays.append(_array([[1 if down else 0 for down in row] for row in feet], ctypes.c_uint8))
            self._check(set_reference(self._memory, len(time_s), *arrays))
            self._reference = arrays

        def step(self, time_s, x, dx, feet):
            command = Command()
            state = [_array(values, number) for values in (x, dx)]
            down = _array([1 if down else 0 for down in feet], ctypes.c_uint8)
            step(self._memory, time_s, *state, down, ctypes.byref(command))
            return command

        def status_text(self, status):
            return status_text(status).decode()

        def close(self):
            self._memory = None

        @staticmethod
        def _check(status):
            if status != 0:
                raise ValueError(status_text(status).decode())

    class Library:
        """The library of the module."""

        def __init__(self):
            self.default_settings = default_settings

    class Machine:
        """The state machine around a controller that walks by commands."""

        def __init__(self, changes=()):
            def of(name, result, *arguments):
                found = getattr(library, facts["name"] + name)
                found.restype, found.argtypes = result, arguments
                return found

            settings = of("_walk_settings", Settings)()
            for name, value in changes:
                setattr(settings, name, type(getattr(settings, name))(value))
            self._memory = ctypes.create_string_buffer(1 << 22)
            init = of("_machine_init", ctypes.c_int, pointer, ctypes.POINTER(Settings), pointer)
            Controller._check(init(self._memory, ctypes.byref(settings), None))
            Controller._check(of("_machine_set_walk", ctypes.c_int, pointer)(self._memory))
            self._stand = of("_machine_stand", ctypes.c_int, pointer, number, pointer)
            self._walk = of("_machine_walk", ctypes.c_int, pointer, number, number, number)
            self._stop = of("_machine_stop", ctypes.c_int, pointer)
            self._mode = of("_machine_mode", ctypes.c_int, pointer)
            self._mode_text = of("_machine_mode_text", ctypes.c_char_p, ctypes.c_int)
            self._step = of(
                "_machine_step", ctypes.c_int, *step.argtypes
            )

        def stand(self, time_s, x):
            return bool(self._stand(self._memory, time_s, _array(x, number)))

        def walk(self, forward_m_s, left_m_s, yaw_rate_rad_s):
            return bool(self._walk(self._memory, forward_m_s, left_m_s, yaw_rate_rad_s))

        def stop(self):
            return bool(self._stop(self._memory))

        def mode(self):
            return self._mode_text(self._mode(self._memory)).decode()

        def step(self, time_s, x, dx, feet):
            command = Command()
            state = [_array(values, number) for values in (x, dx)]
            down = _array([1 if down else 0 for down in feet], ctypes.c_uint8)
            self._step(self._memory, time_s, *state, down, ctypes.byref(command))
            return command

        def status_text(self, status):
            return status_text(status).decode()

    return types.SimpleNamespace(Library=Library, Controller=Controller, Machine=Machine)


def _array(values, kind):
    """A C array of rows or of a flat sequence."""
    flat = list(values.ravel()) if hasattr(values, "ravel") else _flat(values)
    return (kind * len(flat))(*flat)


def _flat(values):
    flat = []
    for value in values:
        flat.extend(_flat(value) if hasattr(value, "__len__") else [value])
    return flat
