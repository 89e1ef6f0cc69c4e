"""Pictures that only the paper's pages need, in the style of :mod:`unconstrain.pages.figures`."""
