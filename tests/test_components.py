# SPDX-License-Identifier: GPL-2.0-or-later
"""Components against scipy's, on random graphs and on the ones that are slow to join."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from alup.geometry.connected_components import components


def expected(edges: np.ndarray, count: int) -> tuple[int, np.ndarray]:
    ones = np.ones(len(edges))
    return connected_components(coo_matrix((ones, tuple(edges.T)), shape=(count, count)), directed=False)


@pytest.mark.parametrize("seed", range(20))
def test_random_graphs(seed: int) -> None:
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 300))
    edges = random.integers(0, count, (int(random.integers(0, 2 * count)), 2))
    number, label = components(edges, count)
    wanted, wanted_label = expected(edges, count)
    assert number == wanted
    assert (label == wanted_label).all()


@pytest.mark.parametrize("shape", ["path", "shuffled path", "star", "high star", "tree"])
def test_shapes_that_take_many_steps(shape: str) -> None:
    count = 5000
    nodes = np.arange(count)
    if shape == "shuffled path":
        nodes = np.random.default_rng(0).permutation(count)
    if "star" in shape:
        centre = 0 if shape == "star" else count - 1
        edges = np.stack([np.full(count, centre), nodes], axis=1)
    elif shape == "tree":
        edges = np.stack([nodes[1:], (nodes[1:] - 1) // 2], axis=1)
    else:
        edges = np.stack([nodes[:-1], nodes[1:]], axis=1)
    number, label = components(edges, count)
    assert number == 1
    assert not label.any()


def test_labels_are_in_the_order_of_first_members() -> None:
    number, label = components(np.array([[4, 1], [0, 3]]), 6)
    assert number == 4
    assert label.tolist() == [0, 1, 2, 0, 1, 3]


def test_no_node_and_no_edge() -> None:
    number, label = components(np.zeros((0, 2), dtype=int), 0)
    assert (number, len(label)) == (0, 0)
    assert components(np.zeros((0, 2), dtype=int), 3)[0] == 3
