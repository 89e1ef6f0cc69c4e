"""Whether recordings are what they seem: evidence in the numbers, not in the names; each finding with what cures it.

A new check is one function from a :class:`~.subject.Subject` to a remark or None, listed in :data:`.checks.CHECKS`.
"""
