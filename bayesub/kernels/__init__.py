"""Compiled physics: arrays in, arrays out, SI units and radians; NumPy, numba and LLVM only.

Coefficient sets are simulated side by side in *lanes*: a block of ``LANES`` sets shares one flat workspace in which
row ``k`` of lane ``i`` stands at ``k * LANES + i``, so that the innermost loops run over lanes and compile to packed
instructions. Short blocks are padded, so every set passes through the same instructions whatever its batch.
"""
