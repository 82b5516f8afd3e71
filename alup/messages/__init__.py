# SPDX-License-Identifier: GPL-2.0-or-later
"""What is said to the person: the errors he can do something about, and the language they are told in.

In: English texts with named fields. Out: sentences in the language of the environment.
"""
