"""Pictures in three dimensions."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...base.arrays import Array, require_extra
from .planes import broken
from .style import COLOURS, DASHES, PALETTE, figure, keyed


def movements(
    tracks: Sequence[tuple[str, Array]],
    plates: Sequence[tuple[str, Array]] = (),
    *,
    labels: tuple[str, str, str] = ("x (m)", "y (m)", "z (m)"),
) -> Any:
    """Movements in space, and the plates they were made on, with equal axes.

    Parameters
    ----------
    tracks : sequence of (key, states)
        The key decides the colour and what is hidden together; states (T, 3).
    plates : sequence of (key, corners)
        Corners (4, 3) of plates, going round; drawn translucent in the colour of their key.
    labels : tuple of str
        Of the axes, with their unit.
    """
    made = figure(height=350, projection="3d")
    [axes] = made.axes
    others = [key for key in dict.fromkeys(key for key, _ in tracks) if key not in COLOURS]
    own = {key: {"color": PALETTE[index % len(PALETTE)]} for index, key in enumerate(others)}
    faces = require_extra("mpl_toolkits.mplot3d.art3d", "viz").Poly3DCollection
    for key, corners in plates:
        axes.add_collection3d(faces([corners], alpha=0.12, **keyed(key, **own.get(key, {}))))
    for key, states in tracks:
        look = {"linewidth": 0.9 if key == "training" else 1.3, "linestyle": DASHES.get(key, "-")}
        axes.plot(*broken(states).T, **keyed(key, **look, **own.get(key, {})))
    seen = np.concatenate([states for _, states in tracks])
    low, high = np.nanmin(seen, axis=0), np.nanmax(seen, axis=0)
    size = np.maximum(high - low, 0.25 * max(float((high - low).max()), 1e-12))
    for name, label, middle, half in zip("xyz", labels, (low + high) / 2, 0.55 * size, strict=True):
        getattr(axes, f"set_{name}label")(label, labelpad=8)  # beyond the ticks
        getattr(axes, f"set_{name}lim")(middle - half, middle + half)
        getattr(axes, f"{name}axis").set_pane_color((0, 0, 0, 0))
        getattr(axes, f"{name}axis").set_major_locator(require_extra("matplotlib.ticker", "viz").MaxNLocator(4))
    axes.set_box_aspect(size, zoom=1.25 if max(map(len, labels)) < 9 else 1.0)  # long names take room
    axes.view_init(elev=24, azim=-52)
    return made
