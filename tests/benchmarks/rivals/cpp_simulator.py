"""What a user who knows C++ would write instead of the simulator: a plain loop over eight boats, for the compiler.

The equations of motion are those of the kernels, written out (:mod:`right_hand_side`) as a line of C++ for each
operation. Sine and cosine are either those of the library, which are called boat by boat, or those of the kernels,
which stand in the loop as everything else does.
"""

import ctypes
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from bayesub.kernels.workspace import LANES, STATE
from bayesub.model.simulator import Simulator
from rivals.right_hand_side import CPP, written
from rivals.scalar_simulator import workspaces

# Without the last two a root that sets errno, and comparisons that could trap, would keep the loop from vectors.
FLAGS = ("-std=c++17", "-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")

_SOURCE = """\
#include <cmath>
#include <cstring>

static void derivative(const double (*__restrict__ work)[8], const double *__restrict__ control,
                       double (*__restrict__ rates)[8]) {
    double sine[3][8], cosine[3][8];
    for (int i = 0; i < 8; i++) {
        SINES
    }
    for (int i = 0; i < 8; i++) {
        RATES
    }
}

// States (n_blocks, 8, n_steps + 1, 12) from blocks of eight boats and controls at start, middle and end of steps.
extern "C" void fly(const double (*blocks)[N_ROWS][8], long n_blocks, const double (*stages)[3][N_CONTROLS],
                    long n_steps, double step, double *states) {
    const int part[4] = {0, 1, 1, 2};
    const double weight[4] = {1.0, 2.0, 2.0, 1.0}, ahead[4] = {0.5 * step, 0.5 * step, step, 0.0};
    for (long block = 0; block < n_blocks; block++, states += 8 * (n_steps + 1) * 12) {
        alignas(64) double work[N_ROWS][8], state[12][8], rates[12][8], total[12][8];
        std::memcpy(work, blocks[block], sizeof work);
        std::memcpy(state, work[STATE], sizeof state);
        for (long n = 0;; n++) {
            for (int i = 0; i < 8; i++)
                for (int k = 0; k < 12; k++) states[(i * (n_steps + 1) + n) * 12 + k] = state[k][i];
            if (n == n_steps) break;
            std::memset(total, 0, sizeof total);
            for (int j = 0; j < 4; j++) {
                derivative(work, stages[n][part[j]], rates);
                for (int k = 0; k < 12; k++)
                    for (int i = 0; i < 8; i++) {
                        total[k][i] += weight[j] * rates[k][i];
                        work[STATE + k][i] = state[k][i] + ahead[j] * rates[k][i];
                    }
            }
            for (int k = 0; k < 12; k++)
                for (int i = 0; i < 8; i++) work[STATE + k][i] = state[k][i] += step / 6.0 * total[k][i];
        }
    }
}
"""


def source(simulator: Simulator, library_sines: bool) -> str:
    """The C++ of a simulator."""
    sines: list[str] = []

    def of_library(angle):
        names = [f"{name}[{len(sines) // 2}][i]" for name in ("sine", "cosine")]
        sines.extend(f"{name} = std::{call}({angle});" for name, call in zip(names, ("sin", "cos"), strict=True))
        return names

    lines, rates = written(simulator.kernels, CPP, of_library if library_sines else None)
    lines += [f"rates[{k}][i] = {rate};" for k, rate in enumerate(rates)]
    sizes = {"N_ROWS": simulator.kernels.n_rows, "N_CONTROLS": simulator._stages.shape[2], "STATE": STATE}
    text = _SOURCE
    for name, part in {"SINES": "\n        ".join(sines), "RATES": "\n        ".join(lines), **sizes}.items():
        text = text.replace(name, str(part))
    return text


def compiler() -> str | None:
    """The C++ compiler of this system: that of the environment variable CXX, or c++."""
    return shutil.which(os.environ.get("CXX", "c++"))


class CppSimulator:
    """A simulator in C++, compiled when it is made, for a number of boats that is a multiple of LANES.

    Raises
    ------
    subprocess.CalledProcessError
        If the compiler fails.
    """

    def __init__(self, simulator: Simulator, *, library_sines: bool):
        self.simulator = simulator
        with tempfile.TemporaryDirectory() as folder:
            file, library = Path(folder, "simulator.cpp"), Path(folder, "simulator.so")
            file.write_text(source(simulator, library_sines), encoding="utf-8")
            subprocess.run([compiler(), *FLAGS, file, "-o", library], check=True, capture_output=True, text=True)
            self._fly = ctypes.CDLL(str(library)).fly

    def prepared(self, xi: np.ndarray) -> np.ndarray:
        """Coefficients (n_batch, n_terms) as :meth:`run` wants them."""
        return workspaces(self.simulator, xi)

    def run(self, blocks: np.ndarray) -> np.ndarray:
        """States (n_batch, n_steps + 1, 12) at all steps."""
        stages, step = self.simulator._stages, self.simulator.step
        states = np.empty((len(blocks) * LANES, len(stages), 12))
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in (blocks, stages, states)]
        n_blocks, n_steps = ctypes.c_long(len(blocks)), ctypes.c_long(len(stages) - 1)
        self._fly(pointers[0], n_blocks, pointers[1], n_steps, ctypes.c_double(step), pointers[2])
        return states
