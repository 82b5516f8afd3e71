"""The errors a person can do something about.

Every message is one or two sentences that name the object and the remedy; the effect shows
it as it is.  Anything else that is raised is a defect of this package.
"""


class AlupError(Exception):
    """Base of all errors that are meant for the user."""


class DocumentError(AlupError):
    """The selected objects can't be reshaped as they are."""


class HandleError(AlupError):
    """The handles are missing, incomplete or contradict each other."""


class SolveError(AlupError):
    """The least-squares problem could not be solved."""


class DependencyError(AlupError):
    """A package that a run needs is missing."""
