"""Collision detectors and contact responses of surgical simulation: the module of the testbed trocar.

Lengths are in m, forces in N, times in s, unless a name or a unit says otherwise. Positions are in the world frame.
Bad input raises InputError with one line: where, what was expected, what was found. A method that fails raises nothing:
its `outcome` says how it ended, as in the command line's tables.

docs/PYTHON.md has the whole description.
"""

from __future__ import annotations

import collections.abc as _abc
import hashlib
import importlib
import inspect
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _trocar
from ._trocar import (CONTACT, CONTACT_FORCE, FORCE_LAW, POSITION_CORRECTION, SOLVED_CONTACT, Detection, Frame,
                      InputError, Materials, PredictedStep, Tick, Topology, __version__, force_laws,
                      triangles_intersect)

if TYPE_CHECKING:
    import pandas as _pandas  # type: ignore

__all__ = [
    "CONTACT", "CONTACT_FORCE", "FORCE_LAW", "POSITION_CORRECTION", "SOLVED_CONTACT", "Detection", "Detector", "Frame",
    "InputError", "Materials", "PredictedStep", "Report", "Response", "Result", "Simulation", "Tick", "Topology",
    "__version__", "detect", "force_laws", "make_detector", "read_report", "register_detector", "register_response",
    "run", "study", "triangles_intersect",
]

PathLike = Union[str, "os.PathLike[str]"]

_methods_variable = "TROCAR_PYTHON_METHODS"  # lines NAME=MODULE:CLASS: the methods of a child process


def _share() -> Path:
    """Folder with scenes and studies: that of the installation, else the clone around the build tree."""
    package = Path(__file__).absolute().parent
    installed = package.parents[3] / "share" / "trocar"
    if installed.is_dir():
        return installed
    return next((above for above in package.parents if (above / "scenes").is_dir()), installed)


_trocar.add_shipped_root(_share())


# ---------------------------------------------------------------- methods written in Python


class Detector:
    """Base of a detector written in Python: a prototype, slow, and not to be timed.

    Objects are made without arguments, or with the values of `parameters` as keyword arguments. An exception of update
    or detect is the outcome `threw` of that tick.
    """

    query_distance: bool = False
    """True: detect also returns the pairs within the query distance; False: such a question ends as `unsupported`."""
    claims_exact: bool = False
    """True: a report calls any difference to the exact pairs an error of this method."""
    parameters: _abc.Mapping[str, Tuple[float, str, str]] = {}
    """{name: (default, unit, meaning)}: settings that `name:key=value` and studies may change."""

    def prepare(self, topology: Topology, frame: Frame) -> None:
        """Once per run, on the first frame whose positions are finite."""

    def update(self, frame: Frame, query_distance: float) -> None:
        """Once per tick, before detect. query_distance: m, 0 for intersecting pairs only."""

    def detect(self, frame: Frame) -> Any:
        """Once per tick: the intersecting pairs, (n, 2) integers, triangle numbers of the topology, in any order.

        With a query distance above 0: the tuple (pairs, near), near being the disjoint pairs within it.
        """
        raise NotImplementedError


class Response:
    """Base of a response written in Python: a prototype, slow, and not to be timed.

    Objects are made as those of a Detector. An exception of respond is the outcome `threw` of the run.
    """

    contact_generators: _abc.Sequence[str] = ("tracked_proximity",)
    """Contact generators that it can use, its default first."""
    parameters: _abc.Mapping[str, Tuple[float, str, str]] = {}
    """{name: (default, unit, meaning)}: settings that `name:key=value` and studies may change."""

    def prepare(self, topology: Topology, materials: Materials) -> None:
        """Once per run."""

    def respond(self, frame: Frame, dt: float, contacts: npt.NDArray[Any],
                contact_forces: npt.NDArray[Any]) -> Union[npt.NDArray[Any], Dict[str, Any]]:
        """Once per tick: the contact force laws, an array of trocar.FORCE_LAW (trocar.force_laws(n) has the defaults).

        Or a dict, each key of which may be absent: contacts, that array; held_force, (vertices, 3), N, on tissue over
        the tick; position_corrections, an array of trocar.POSITION_CORRECTION, states that tissue vertices (one entry
        each) have before the tissue is integrated; wrench, (bodies, 6), force in N and moment in N m about the world's
        origin, on instruments; contact_timing, "implicit" (as without it), "at_tick_start" or "at_substep_start";
        solver_timing, "substep" (as without it) or "held".

        contacts: array of trocar.CONTACT. contact_forces: array of trocar.CONTACT_FORCE, one per law of the last tick;
        empty at the first. dt: s.
        """
        raise NotImplementedError

    def solve(self, step: PredictedStep) -> None:
        """In every sub-step (solver_timing) of tissue: applies impulses to the laws of role 4, "solved".

        Such a law pushes tissue and has k = mu = 0. The answer depends on the step alone.
        """
        raise NotImplementedError


_registered: Dict[Tuple[str, str], Tuple[type, str, str]] = {}
"""Class, version and place (MODULE:CLASS or file) by kind and name; no place: no other process can load it."""


def _place_of(cls: type) -> str:
    is_importable = cls.__module__ != "__main__" and "<locals>" not in cls.__qualname__
    return f"{cls.__module__}:{cls.__qualname__}" if is_importable else ""


def _version(content: bytes) -> str:
    return f"slow prototype, source {hashlib.sha256(content).hexdigest()[:12]}"


def _version_of(cls: type) -> str:
    """Hash over the files of the class and its bases, so that an edited file is another version."""
    content = b""
    for one in cls.__mro__:
        if one in (object, Detector, Response):
            continue
        try:
            content += Path(inspect.getsourcefile(one) or "").read_bytes()
        except (OSError, TypeError):
            try:
                content += inspect.getsource(one).encode()
            except (OSError, TypeError):
                content += repr(one).encode()
    return _version(content)


def _register(name: str, cls: type, call: str, parent: type, version: str = "", place: str = "") -> None:
    kind = parent.__name__.lower()
    what = f"trocar.register_{kind}"
    if not (isinstance(name, str) and re.fullmatch("[a-z][a-z0-9_]*", name)):
        raise InputError(f"{what}: expected a name of lower-case letters, digits and _, got {name!r}")
    if not (isinstance(cls, type) and callable(getattr(cls, call, None))):
        raise InputError(f"{what}: {name}: expected a class with a method {call}, got {cls!r}")
    entry = (cls, version or _version_of(cls), place or _place_of(cls))
    if _registered.get((kind, name)) == entry:
        return
    whole = cls if issubclass(cls, parent) else type(cls.__name__, (cls, parent), {})
    try:
        (_trocar.register_detector if parent is Detector else _trocar.register_response)(name, whole, entry[1])
    except (TypeError, RuntimeError) as error:
        raise InputError(f"{what}: {name}: expected attributes as those of trocar.{parent.__name__}, got {error}"
                         .split("\n")[0]) from None
    _registered[kind, name] = entry


def register_detector(name: str, cls: type) -> None:
    """Gives a Python class (see Detector) a name that detector=, studies and `python3 -m trocar` understand.

    The same name again replaces the class. Raises InputError for another class or name, for a name of trocar's own
    methods, and while a run is under way in another thread.
    """
    _register(name, cls, "detect", Detector)


def register_response(name: str, cls: type) -> None:
    """The same for a response (see Response)."""
    _register(name, cls, "respond", Response)


def _name_of(method: Union[str, type], register: Any) -> str:
    """Text of a method; a class is registered under its name in lower case."""
    if isinstance(method, type):
        name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", method.__name__).lower()
        register(name, method)
        return name
    return method


def _register_any(name: str, cls: type, version: str = "", place: str = "") -> None:
    if callable(getattr(cls, "respond", None)):
        _register(name, cls, "respond", Response, version, place)
    else:
        _register(name, cls, "detect", Detector, version, place)


def _register_named(text: str) -> None:
    """Registers NAME=MODULE:CLASS, or NAME=FILE of a class that _copied wrote. Raises InputError."""
    name, is_named, place = text.partition("=")
    is_file = ":" not in place and place.endswith(".pickle")
    module, is_module, qualname = place.partition(":")
    if not is_named or not (is_module or is_file):
        raise InputError(f"--method: expected NAME=MODULE:CLASS, got '{text}'")
    try:
        content = Path(place).read_bytes() if is_file else b""
        cls: Any = pickle.loads(content) if is_file else importlib.import_module(module)
        for part in () if is_file else qualname.split("."):
            cls = getattr(cls, part)
    except Exception as error:  # whatever the module raises on import
        reason = f"{type(error).__name__}: {error}".split("\n")[0]
        raise InputError(f"--method {text}: expected a class that can be imported, got {reason}") from None
    # cloudpickle numbers classes by uuid, and names of cells have the number of their process.
    version = _version(re.sub(rb"[0-9a-f]{32}|ipykernel_[0-9]+", b"", content)) if is_file else ""
    _register_any(name, cls, version, place if is_file else "")


def _methods_text(copied: _abc.Sequence[str] = ()) -> str:
    """The registered methods that a child process can load, as _methods_variable. copied: further ones, NAME=FILE."""
    return "\n".join([f"{name}={place}" for (_, name), (_, _, place) in _registered.items() if place] + list(copied))


def _copied(kind: str, name: str, cls: type, folder: str) -> str:
    """NAME=FILE, with which another process finds a class that it cannot import, with what the class uses.

    Its bytes are the version, but for what another process or a class of the same text would have in them.
    """
    here = f"{cls.__module__}.{cls.__qualname__}"
    try:
        import cloudpickle  # type: ignore
    except ImportError:
        raise InputError(f"method {name}: expected a class of a module, or the package cloudpickle (python3-cloudpickle)"
                         f" for a class of a notebook's cell, got {here} without it") from None
    try:
        content = cloudpickle.dumps(cls)
    except Exception as error:  # whatever an object of the class's surroundings raises
        reason = f"{type(error).__name__}: {error}".split("\n")[0]
        raise InputError(f"method {name}: expected a class that can be copied to another process, got {here}: {reason}"
                         ) from None
    file = Path(folder) / f"{kind}-{name}.pickle"
    file.write_bytes(content)
    return f"{name}={file}"


# ---------------------------------------------------------------- detection


def detect(vertices_a: Union[npt.ArrayLike, PathLike], faces_a: Union[npt.ArrayLike, PathLike, None] = None,
           vertices_b: Optional[npt.ArrayLike] = None, faces_b: Optional[npt.ArrayLike] = None,
           detector: Union[str, type] = "ohc_clustered", truth: bool = False,
           data: Optional[PathLike] = None) -> Detection:
    """All intersecting triangle pairs of two meshes, or of a scene's first frame.

    detect(vertices_a, faces_a, vertices_b, faces_b): vertices (N, 3) numbers of one unit, faces (T, 3) integers.
    Floating-point and integer types of any memory layout are accepted and copied; others are refused.
    detect(file_a, file_b): two mesh files (OBJ, STL, PLY, OFF, VRML), in their unit.
    detect(scene): a scene file, or a name of `trocar scenes`. data: folder of its data meshes, else $TROCAR_DATA.

    detector: NAME[:key=value,...] or a class (see Detector). truth: compare with the exact pairs.

    Returns a Detection: pairs (n, 2) int32, sorted by (a, b), numbers of faces_a and faces_b, of a scene those of its
    topology; touches (n,) bool, True where two triangles only touch; counters; outcome, message. The detector runs in
    this process, which its crash would end. Raises InputError.
    """
    name = _name_of(detector, register_detector)
    if faces_a is not None and vertices_b is not None and faces_b is not None:
        return _trocar.detect_arrays(vertices_a, faces_a, vertices_b, faces_b, name, truth)
    if isinstance(vertices_a, (str, os.PathLike)) and vertices_b is None and faces_b is None:
        if faces_a is None:
            return _trocar.detect_scene(vertices_a, name, truth, data)
        if isinstance(faces_a, (str, os.PathLike)):
            return _trocar.detect_files(vertices_a, faces_a, name, truth)
    given = [type(one).__name__ for one in (vertices_a, faces_a, vertices_b, faces_b) if one is not None]
    raise InputError("trocar.detect: expected four arrays, two mesh files or one scene, got " + ", ".join(given))


def make_detector(detector: Union[str, type]) -> _trocar.OneDetector:
    """A detector for calls one at a time: prepare(topology, frame), update(frame), detect(frame) -> (pairs, near).

    The arrays own their memory. A failure raises RuntimeError with the outcome. Raises InputError.
    """
    return _trocar.OneDetector(_name_of(detector, register_detector))


# ---------------------------------------------------------------- runs


class Simulation(_trocar.Simulation):
    """A scene with a detector and a response, a tick at a time. Arguments are those of run.

    step() does one tick and returns its Tick, a mapping from the names of Result.columns to values. The lock of the
    interpreter is released meanwhile.

    positions, velocities (N, 3) float64: after the last tick. pairs (n, 2) int32 and contacts (n,) trocar.CONTACT: of
    its detection, on detected_positions (N, 3). All are read-only views without a copy, valid until the next step();
    copy what must be kept. A view keeps its memory alive; afterwards its numbers may be those of another tick.
    """

    def __init__(self, scene: PathLike, detector: Union[str, type] = "ohc_clustered", contacts: str = "",
                 response: Union[str, type] = "unilateral", stepper: str = "", device: str = "",
                 data: Optional[PathLike] = None) -> None:
        super().__init__(os.fspath(scene), _name_of(detector, register_detector), contacts,
                         _name_of(response, register_response), stepper, device, data)


class Result:
    """One run: its ticks, its figures, and how it ended."""

    def __init__(self, record: _trocar.Record) -> None:
        self._record = record
        self._columns: Optional[Dict[str, npt.NDArray[Any]]] = None

    @property
    def columns(self) -> Dict[str, npt.NDArray[Any]]:
        """Per-tick columns by name, (ticks,) read-only views; `outcome` holds words.

        A number that is not known is NaN in a column of float64, and -1 in a column of counts.
        """
        if self._columns is None:
            self._columns = self._record.columns()
            self._columns["outcome"] = np.array(_trocar.outcome_words())[self._columns["outcome"]]
        return self._columns

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """The column of that name."""
        return self.columns[name]

    @property
    def units(self) -> Dict[str, str]:
        """Units of the columns: SI or ns; 1: a pure number; empty: a flag or a word."""
        return _trocar.column_units()

    @property
    def summary(self) -> Dict[str, float]:
        """Figures of the run by name (`trocar schema figures`); NaN: it does not apply."""
        return self._record.summary

    @property
    def facts(self) -> Dict[str, Any]:
        """What was run, as records have it: keys `spec` and `environment`."""
        facts = json.loads(self._record.facts)
        return {"spec": facts["spec"], "environment": facts["environment"]}

    @property
    def outcome(self) -> str:
        """`ok`, or how the run failed: `threw`, `not_finite`, `unstable`, `unsupported`, ..."""
        return self._record.outcome

    @property
    def message(self) -> str:
        """One sentence on a failure."""
        return self._record.message

    @property
    def state_hash(self) -> str:
        """Hash of the last frame, 16 hexadecimal digits: equal runs have equal ones."""
        return self._record.state_hash

    @property
    def run_id(self) -> str:
        """Name of the run in results.csv, 16 hexadecimal digits."""
        return self._record.run_id

    @property
    def positions(self) -> npt.NDArray[np.float64]:
        """(N, 3), m: after the last tick. Of a run that was read: (0, 3)."""
        return self._record.positions

    def frame(self) -> _pandas.DataFrame:
        """The ticks as a data frame, units in attrs["units"]. Counts that are not known are <NA>."""
        import pandas

        columns: Dict[str, Any] = {}
        for name, values in self.columns.items():
            if values.dtype == np.int64 and bool((values < 0).any()):
                columns[name] = pandas.array(np.where(values < 0, 0, values), dtype="Int64")
                columns[name][values < 0] = pandas.NA
            else:
                columns[name] = values.copy()
        frame = pandas.DataFrame(columns)
        frame.attrs["units"] = self.units
        return frame

    def __repr__(self) -> str:
        spec = self.facts["spec"]
        methods = " + ".join(part for part in (spec["detector"], spec["response"]) if part)
        return f"<trocar.Result {spec['scene']}: {methods}, {len(self.columns['tick'])} ticks, {self.outcome}>"


def run(scene: PathLike, detector: Union[str, type] = "ohc_clustered", contacts: str = "",
        response: Union[str, type] = "unilateral", stepper: str = "", device: str = "", ticks: Optional[int] = None,
        truth_stride: int = 1, data: Optional[PathLike] = None) -> Result:
    """Runs a scene in a closed loop, as `trocar run` does, in this process.

    scene: file, or a name of `trocar scenes`. detector, response: NAME[:key=value,...] or a class. contacts, stepper,
    device: as on the command line; empty: the default. ticks: instead of the scene's number. truth_stride:
    the exact truth is computed on every n-th tick, 0: never. data: folder of data meshes, else $TROCAR_DATA.

    The lock of the interpreter is released meanwhile. An interruption ends the run with KeyboardInterrupt. Raises
    InputError; a failure of a method is the result's outcome.
    """
    return Result(_trocar.run(os.fspath(scene), _name_of(detector, register_detector), contacts,
                              _name_of(response, register_response), stepper, device, ticks, truth_stride, data))


# ---------------------------------------------------------------- studies and reports


class Report:
    """The records of a study as data frames, with units in attrs["units"]."""

    def __init__(self, directory: PathLike) -> None:
        import pandas

        self.directory = Path(directory)

        file = self.directory / "results.csv"
        if not file.is_file():
            raise InputError(f"{self.directory}: expected the folder of a report with results.csv, got none")
        try:
            self.results: _pandas.DataFrame = pandas.read_csv(file)
        except ValueError as error:
            reason = str(error).split("\n")[0]
            raise InputError(f"{file}: expected a table of runs, got {reason}") from None
        """One row per run: what was run, its outcome and its figures. A figure that does not apply is NaN."""
        units = _trocar.metric_units()
        self.results.attrs["units"] = {name: units[name] for name in self.results.columns if name in units}
        self._runs: Optional[List[Result]] = None
        self._ticks: Optional[_pandas.DataFrame] = None

    @property
    def runs(self) -> List[Result]:
        """The records, in the order in which the study made them; Result.run_id is that of results."""
        if self._runs is None:
            self._runs = [Result(record) for record in _trocar.read_records(self.directory)]
        return self._runs

    @property
    def ticks(self) -> _pandas.DataFrame:
        """The ticks that the records keep, with run_id, scene, detector and response. Unknown counts are <NA>."""
        import pandas

        if self._ticks is None:
            frames = []
            for one in self.runs:
                frame = one.frame()
                spec = one.facts["spec"]
                for place, key in enumerate(("run_id", "scene", "detector", "response")):
                    frame.insert(place, key, one.run_id if key == "run_id" else spec[key])
                frames.append(frame)
            self._ticks = pandas.concat(frames, ignore_index=True) if frames else pandas.DataFrame()
            self._ticks.attrs["units"] = _trocar.column_units()
        return self._ticks


def read_report(directory: PathLike) -> Report:
    """The report of a study in a folder. Raises InputError when there is none."""
    return Report(directory)


def _json_of_study(study: _abc.Mapping[str, Any], output: Path) -> str:
    """The study with its defaults, and with scene files and folders of cases relative to `output` instead of the working directory."""
    def placed(text: str) -> str:
        return os.path.relpath(text, output) if ("/" in text or text.endswith(".json")) else text

    def visit(value: Any, is_scene: bool) -> Any:
        if isinstance(value, type):
            return _name_of(value, _register_any)
        if isinstance(value, _abc.Mapping):
            return {key: os.path.relpath(item, output) if key == "cases" and isinstance(item, str)
                    else visit(item, key == "scenes") for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [visit(item, is_scene) for item in value]
        return placed(value) if is_scene and isinstance(value, str) else value

    whole = {"format": "trocar-study-3", "name": "study", **study}
    try:
        return json.dumps(visit(whole, False), indent=1, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"study: expected values that JSON has, got {error}") from None


def study(study: Union[PathLike, _abc.Mapping[str, Any]], output: Optional[PathLike] = None, jobs: int = 1,
          data: Optional[PathLike] = None) -> Report:
    """Runs a study with its report, as `trocar study` does. Resumes when started again.

    Every run has a process of its own.

    study: file, name of one that comes with trocar, or the content as a dict (docs/STUDIES.md). A dict may leave out
    `format` and `name`, is kept in the folder as study.json, and names scene files relative to the working directory.
    output: folder of records and report; None: build/reports/NAME below the working directory. jobs: so many runs side
    by side, of those that nobody times.

    Registered Python methods take part by their names, and classes in a dict as they stand. The processes of the runs
    import them. A class of a notebook's cell or of the main script is copied to them with cloudpickle. When a class has
    changed, all runs are made again.
    An interruption ends the study with KeyboardInterrupt and keeps the finished runs. Raises InputError.
    """
    is_dict = isinstance(study, _abc.Mapping)
    if isinstance(study, _abc.Mapping):
        output = Path(output or Path("build", "reports", str(study.get("name", "study"))))
        file, text = output / "study.json", _json_of_study(study, output)
    else:
        file = Path(_trocar.find_study(os.fspath(study)))
        text = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""  # the child complains
        named = re.search(r'"name"\s*:\s*"([^"/]+)"', text)
        output = Path(output or Path("build", "reports", named.group(1) if named else "study"))
    with tempfile.TemporaryDirectory() as folder:
        copied = [_copied(kind, name, cls, folder) for (kind, name), (cls, _, place) in _registered.items()
                  if not place and re.search(rf'"{name}[":]', text)]
        return _study_in_child(file, text if is_dict else None, output, jobs, data, copied)


def _study_in_child(file: Path, text: Optional[str], output: Path, jobs: int, data: Optional[PathLike],
                    copied: List[str]) -> Report:
    """text: content for the file, None where it stands."""
    made = [folder for folder in (output, *output.parents) if not folder.exists()]
    before = file.read_bytes() if text is not None and file.is_file() else None
    if text is not None:
        output.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "trocar", "study", str(file), "--output", str(output), "--jobs", str(jobs)]
    if data is not None:
        command += ["--data", str(data)]
    with tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(command, env=_child_environment(copied), stdout=subprocess.DEVNULL, stderr=errors)
        try:
            status = child.wait()
        except KeyboardInterrupt:
            child.send_signal(signal.SIGINT)
            child.wait()
            raise
        errors.seek(0)
        lines = errors.read().decode("utf-8", "replace").strip().split("\n")
    if status == 0:
        return read_report(output)
    if status == 2 and text is not None:  # nothing half written
        if before is None:
            file.unlink()
        else:
            file.write_bytes(before)
        for folder in made:
            if not any(folder.iterdir()):
                folder.rmdir()
    message = re.sub("^trocar: ", "", lines[-1])
    if status == 2:
        raise InputError(message)
    if status in (130, -signal.SIGINT):
        raise KeyboardInterrupt
    raise RuntimeError(f"trocar study ended with status {status}: {message}")


def _child_environment(copied: _abc.Sequence[str] = ()) -> Dict[str, str]:
    """Environment in which a child imports what this process imports, and has its methods."""
    path = os.pathsep.join(os.path.abspath(one) for one in sys.path)
    return {**os.environ, "PYTHONPATH": path, _methods_variable: _methods_text(copied)}


def _main(words: List[str], run_words: Callable[[List[str]], int]) -> int:
    """A command line with the methods of --method NAME=MODULE:CLASS before the first other word."""
    try:
        for text in filter(None, os.environ.get(_methods_variable, "").split("\n")):
            _register_named(text)
        while words and words[0].split("=")[0] == "--method":
            first = words.pop(0)
            if "=" not in first and not words:
                raise InputError("--method: expected NAME=MODULE:CLASS, got nothing")
            _register_named(first.partition("=")[2] if "=" in first else words.pop(0))
    except InputError as error:
        print(f"trocar: {error}", file=sys.stderr)
        return 2
    os.environ.update(_child_environment())
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # as in a program without an interpreter
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    return run_words(words)
