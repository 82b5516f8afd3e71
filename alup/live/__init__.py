# SPDX-License-Identifier: GPL-2.0-or-later
"""The live window: handles are dragged in a page, and the drawing follows while they are.

In comes a document with the objects to reshape, out goes the same document as a batch run of the same handles
would have left it, or nothing.  `engine` knows the drawing and its handles, and answers what the page asks;
`server` is the way between them, for nobody else on the machine or in the browser; `browser` opens a window;
`page/` is what it shows.
"""
