"""Arithmetic of the filter's ticks, compiled: each kernel costs less than calling NumPy for it.

Plain loops, so that the bits do not depend on a linear-algebra library. Kernels of every tick write into their
arguments: returning an array to Python costs more than the arithmetic.
"""
