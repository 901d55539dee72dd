"""Normals, areas, topology and connected components of triangles, in NumPy.

Functions take ``(V, 3)`` vertices and ``(F, 3)`` faces, and compute in double precision. Definitions are those of the
report: a face that names a vertex twice makes a mesh not closed, and faces that share a vertex are one component.
"""

from __future__ import annotations

import numpy as np


def check_faces(vertices: np.ndarray, faces: np.ndarray) -> None:
    """Checks that faces name vertices that are there.

    Raises:
        ValueError: a face that does not; the message has its index.
    """
    if len(faces) and int(faces.max()) >= len(vertices):
        face, corner = np.argwhere(faces >= len(vertices))[0]
        found = faces[face, corner]
        raise ValueError(f"face {face} names vertex {found}, but there are only {len(vertices)}")


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(F, 3)`` unit normals, to the side from which a face is counter-clockwise; 0 for faces without area."""
    sides, _ = _sides(vertices, faces)
    return np.ascontiguousarray(_unit(_cross(sides[0], sides[1])).T)


def face_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(F,)`` areas."""
    sides, scale = _sides(vertices, faces)
    # Not scale², which may be out of range where the area is not.
    areas: np.ndarray = 0.5 * scale * _length(_cross(sides[0], sides[1])) * scale
    return areas


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(V, 3)`` unit normals: those of the faces around a vertex, weighted by their angles in it (Thürmer and
    Wüthrich, Computing Vertex Normals from Polygonal Facets, 1998). 0 for vertices without faces."""
    sides, _ = _sides(vertices, faces)
    cross = _cross(sides[0], sides[1])
    units, height = _unit(cross), _length(cross)
    sums = np.zeros((3, len(vertices)))
    for corner in range(3):
        # Two sides meet in a corner; the second one ends there.
        angle = np.arctan2(height, -_dot(sides[corner], sides[corner - 1]))
        for axis in range(3):
            sums[axis] += np.bincount(faces[:, corner], angle * units[axis], len(vertices))
    return np.ascontiguousarray(_unit(sums).T)


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Enclosed volume by the divergence theorem, positive for faces that are counter-clockwise seen from outside. For an
    open mesh that of the cone from the center of its bounding box, and not meaningful."""
    check_faces(vertices, faces)
    if len(faces) == 0:
        return 0.0
    vertices, faces = compact(vertices, faces)
    low, high = vertices.min(axis=0).astype(float), vertices.max(axis=0).astype(float)
    a, b, c = _corners(vertices - (0.5 * low + 0.5 * high), faces)
    return float(_dot(a, _cross(b, c)).sum() / 6.0)


def is_closed(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Whether there are faces, and each edge is in exactly two of them, with opposite directions."""
    check_faces(vertices, faces)
    if len(faces) == 0:
        return False
    start = faces.astype(np.uint64).ravel()
    end = faces[:, [1, 2, 0]].astype(np.uint64).ravel()
    count = np.uint64(len(vertices))
    there, back = np.sort(start * count + end), np.sort(end * count + start)
    return bool((start != end).all() and (there[1:] != there[:-1]).all() and (there == back).all())


def components(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(F,)`` number of the component of each face; components are numbered by their first faces.

    Trees of vertices are joined at their roots, and flattened by pointer jumping (Shiloach and Vishkin, An O(log n)
    Parallel Connectivity Algorithm, 1982). Two rounds halve the number of roots that still have to be joined.
    """
    check_faces(vertices, faces)
    parent = np.arange(len(vertices))
    one, other = faces[:, :2].ravel(), faces[:, 1:].ravel()
    while True:
        one, other = parent[one], parent[other]
        apart = one != other
        if not apart.any():
            break
        one, other = one[apart], other[apart]
        np.minimum.at(parent, np.maximum(one, other), np.minimum(one, other))
        parent = _flat(parent)
    _, first, numbers = np.unique(parent[faces[:, 0]], return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[numbers]


def compact(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The vertices that faces name, in their order, and the faces with their new numbers."""
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    return vertices[used], (np.cumsum(used) - 1)[faces]


def split(vertices: np.ndarray, faces: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Vertices and faces of each component, in their order, without the vertices that no face names."""
    numbers = components(vertices, faces)
    vertices, faces = compact(vertices, faces)
    of_vertex = np.zeros(len(vertices), int)
    of_vertex[faces] = numbers[:, None]
    vertex_order, vertex_end = _groups(of_vertex)
    face_order, face_end = _groups(numbers)
    # Number of each vertex, counted from the first one of its component.
    place = np.empty_like(vertex_order)
    place[vertex_order] = np.arange(len(vertices))
    first = np.concatenate([[0], vertex_end])
    faces = place[faces] - first[numbers][:, None]
    parts = zip(np.split(vertices[vertex_order], vertex_end), np.split(faces[face_order], face_end))
    return [part for part in parts if len(part[1])]


def _groups(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The order that sorts entries by their numbers, and the end of each group but the last."""
    return np.argsort(numbers, kind="stable"), np.cumsum(np.bincount(numbers))[:-1]


def _flat(parent: np.ndarray) -> np.ndarray:
    """The root of each vertex."""
    while True:
        above = parent[parent]
        if np.array_equal(above, parent):
            return parent
        parent = above


# Vectors below are (3, N): NumPy is several times faster along the last axis.


def _corners(vertices: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    check_faces(vertices, faces)
    columns = np.ascontiguousarray(vertices.T, float)
    return [columns[:, np.ascontiguousarray(faces[:, k])] for k in range(3)]


def _sides(vertices: np.ndarray, faces: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """The three sides of each face, from each corner to the next, divided by the ``(F,)`` largest of their components, so
    that products neither overflow nor vanish."""
    corners = _corners(vertices, faces)
    sides = [corners[(k + 1) % 3] - corners[k] for k in range(3)]
    scale = np.max([np.abs(side).max(axis=0) for side in sides], axis=0)
    divisor = np.where(scale > 0.0, scale, 1.0)
    return [side / divisor for side in sides], scale


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.stack([a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    products: np.ndarray = np.einsum("ij,ij->j", a, b)
    return products


def _length(vectors: np.ndarray) -> np.ndarray:
    lengths: np.ndarray = np.sqrt(_dot(vectors, vectors))
    return lengths


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length 1; those without length stay 0."""
    lengths = _length(vectors)
    units = np.zeros_like(vectors)
    np.divide(vectors, lengths, out=units, where=lengths != 0.0)
    return units
