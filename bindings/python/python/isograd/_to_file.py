"""One cloud to one file, for data sets of many shapes."""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import tempfile
import time
import zipfile
import zlib
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._files import write_sdf
from ._grid import Grid
from ._inputs import read_input
from ._options import Options, resolve
from ._reconstruction import Reconstruction, Reconstructor
from ._settings import check_backend

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Unpack

    from ._inputs import CloudLike
    from ._options import OptionChanges

    Path = str | os.PathLike[str]


def to_file(
    cloud: CloudLike,
    out: Path,
    *,
    grid: Grid | None = None,
    resolution: int | None = None,
    normals: ArrayLike | None = None,
    sensors: ArrayLike | None = None,
    options: Options | None = None,
    backend: str = "cpu",
    **changes: Unpack[OptionChanges],
) -> dict[str, Any]:
    """Reconstructs φ of a cloud and writes it to a file, unless the file is there already.

    A step of a large job that can be stopped at any time and run again: the same input gives the same bytes, for any number
    of threads.

    A file counts as there if it is undamaged (checksums are compared) and was made by this version of isograd from the same
    numbers with the same settings. Files are written atomically.

    Args:
        cloud: points as :func:`reconstruct` takes them; best the name of a file.
        out: ``.npz`` (arrays ``sdf``, ``origin`` and ``spacing`` as :func:`write_sdf`, and the texts ``verdict`` and
            ``settings``) or ``.vti`` (with both in a comment).
        grid: grid of φ; by default ``Grid.fit`` with ``resolution``.
        resolution: cells on the longest side; 128 by default.
        normals: as :func:`reconstruct`.
        sensors: as :func:`reconstruct`.
        options: as :func:`reconstruct`.
        backend: as :func:`reconstruct`.
        changes: single options by name, such as ``orient="given"``.

    Returns:
        ``path``; ``verdict``, also of a file that was there (``None`` with ``checks=False``), instead of a warning;
        ``seconds`` of this call; ``skipped``: whether the file was there.

    Raises:
        as :func:`read_points` and :func:`reconstruct`; ValueError: another extension; FileNotFoundError: a missing folder.
    """
    start = time.perf_counter()
    path = os.fspath(out)
    kind = _check_path(path)
    if grid is not None and resolution is not None:
        raise ValueError("give grid or resolution, not both")
    options = resolve(options, changes)
    points, normals, sensors = read_input(cloud).arrays(normals, sensors, options.orient)
    settings = {
        "isograd": _core.__version__,
        "options": asdict(options),
        "grid": None if grid is None else asdict(grid),
        "resolution": resolution,
        "backend": check_backend(backend),
    }
    settings["fingerprint"] = _fingerprint(settings, points, normals, sensors)
    about = _read_about(path, kind)
    skipped = about is not None and about["settings"]["fingerprint"] == settings["fingerprint"]
    if about is None or not skipped:
        if grid is None:
            grid = Grid.fit(points, resolution, outliers=options.outliers)
        plan = Reconstructor(grid, options, backend=backend)
        result = plan._run(points, normals=normals, sensors=sensors)
        verdict = result.verdict if options.checks else None
        about = {"verdict": verdict, "settings": settings}
        _core.write_bytes(path, _WRITERS[kind](result, about))
    seconds = time.perf_counter() - start
    return {"path": path, "verdict": about["verdict"], "seconds": seconds, "skipped": skipped}


def _check_path(path: str) -> str:
    """The extension of an output in an existing folder.

    Raises:
        ValueError, FileNotFoundError: another extension; a missing folder.
    """
    kind = os.path.splitext(path)[1].lower()
    if kind not in _WRITERS:
        raise ValueError(f"{path}: the name must end in {' or '.join(_WRITERS)}")
    if not os.path.isdir(os.path.dirname(path) or "."):
        raise FileNotFoundError(f"the folder of {path} is missing; create it first")
    return kind


def _fingerprint(settings: dict[str, Any], *arrays: np.ndarray | None) -> str:
    """SHA-256 of settings and arrays."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for array in arrays:
        if array is not None:
            digest.update(f"{array.dtype.str}{array.shape}".encode())
            digest.update(array.tobytes())
        digest.update(b";")
    return digest.hexdigest()


def _npz(result: Reconstruction, about: dict[str, Any]) -> bytes:
    buffer = io.BytesIO()
    np.savez(
        buffer,
        sdf=result.sdf,
        origin=np.array(result.grid.origin),
        spacing=np.array(result.grid.spacing),
        verdict=np.array(about["verdict"] or "not checked"),
        settings=np.array(json.dumps(about)),
    )
    return buffer.getvalue()


def _vti(result: Reconstruction, about: dict[str, Any]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "field.vti")
        write_sdf(file, result.grid, result.sdf)
        with open(file, "rb") as stream:
            head, rest = stream.read().split(b"\n", 1)
    # A comment in XML must not have two hyphens.
    text = json.dumps(about).replace("--", "-\\u002d").encode()
    digest = hashlib.sha256(head + text + rest).hexdigest().encode()
    return b"\n".join([head, b"<!-- isograd %b %b -->" % (digest, text), rest])


def _read_npz(path: str) -> dict[str, Any] | None:
    with zipfile.ZipFile(path) as archive:
        if archive.testzip() is not None:
            return None
        with archive.open("settings.npy") as member:
            about: dict[str, Any] = json.loads(str(np.lib.format.read_array(member, allow_pickle=False)))
            return about


def _read_vti(path: str) -> dict[str, Any] | None:
    with open(path, "rb") as stream:
        head, comment, rest = stream.read().split(b"\n", 2)
    found = re.fullmatch(rb"<!-- isograd ([0-9a-f]{64}) (.*) -->", comment)
    if found is None or hashlib.sha256(head + found[2] + rest).hexdigest().encode() != found[1]:
        return None
    about: dict[str, Any] = json.loads(found[2])
    return about


_WRITERS = {".npz": _npz, ".vti": _vti}
_READERS = {".npz": _read_npz, ".vti": _read_vti}


def _read_about(path: str, kind: str) -> dict[str, Any] | None:
    """Verdict and settings in a file of :func:`to_file`; ``None`` if it is missing, damaged, or another one."""
    try:
        about = _READERS[kind](path)
        about["settings"]["fingerprint"], about["verdict"]  # type: ignore[index]
        return about
    except (OSError, ValueError, TypeError, KeyError, EOFError, NotImplementedError, RuntimeError):
        return None
    except (zipfile.BadZipFile, zlib.error):
        return None
