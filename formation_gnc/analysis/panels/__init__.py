"""Panels of the pictures and of the page, one file each; `registry` lists them."""
