"""The colours of figures in the dark. Figures are made in those of paper; a page exchanges them."""

from __future__ import annotations

#: Colour on paper → colour on a dark page. Hues stay; what is too dark there becomes lighter.
NIGHT = {
    "#ffffff": "#14191f",  # the page
    "#fff": "#14191f",
    "#1f2933": "#e3e8ee",  # ink
    "#6b7785": "#9ba7b4",  # captions
    "#e3e7eb": "#2b333c",  # grids
    "#cfd6dd": "#3a444f",
    "#b8c0c8": "#6d7884",  # axes, and bars that nothing is said about
    "#9aa5b1": "#6d7884",
    "#eef2f6": "#1d242c",  # rests
    "#e4eaf1": "#27313c",  # ripple
    "#8fa6bd": "#8fa6bd",  # the workspace
    "#0072B2": "#4da3dc",
    "#D55E00": "#f0803c",
    "#009E73": "#2fbf95",
    "#CC79A7": "#cc79a7",
    "#E69F00": "#e69f00",
    "#56B4E9": "#56b4e9",
    "#4d4d4d": "#b4bcc5",
    "#8c6d1f": "#c29a45",
}
