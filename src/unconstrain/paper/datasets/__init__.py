"""Recordings of others: found, checked and, only if asked for, fetched; and a few of our own, which come along.

Each loader of those of others takes ``download=True`` and keeps what it fetched, save that of the signs: nobody offers
these as a plain file at a fixed place. Local copies are looked for in the folder named by ``UNCONSTRAIN_DATA``.

Examples
--------
>>> [name for name in dir(uc.datasets) if name.startswith("load_")]
['load_contour', 'load_fingertip', 'load_hand_tracks', 'load_handwriting', 'load_rim_wiping']
"""

from .contours import load_contour as load_contour
from .example import write_example as write_example
from .fingertip import load_fingertip as load_fingertip
from .hands import load_hand_tracks as load_hand_tracks
from .handwriting import load_handwriting as load_handwriting
from .rim import WipingBout as WipingBout
from .rim import load_rim_wiping as load_rim_wiping
