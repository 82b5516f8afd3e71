"""What is regular in a drawing, and how it stays regular.

In go the drawing, the samples (N, 2) along each of its segments and, later, where a core round moved them, all
in user units.  Out come the relations that were found, and places for the samples of what takes part in them:
the final round holds these there.
"""
