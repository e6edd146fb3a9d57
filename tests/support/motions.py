"""Control histories that several tests fly."""

import numpy as np

from bayesub.model.manoeuvres import Manoeuvre


def smooth_manoeuvre(vehicle, duration, spacing=1 / 16, period=40.0, rudder=0.12, stern=0.03):
    """Rudder and stern planes that swing between zero and twice the amplitude, sampled every `spacing`."""
    times = np.arange(round(duration / spacing) + 1) * spacing
    swing = 1.0 - np.cos(2 * np.pi * times / period)
    controls = np.stack([rudder * swing, 0.3 * stern * swing, -stern * swing], axis=1)
    initial = np.zeros(12)
    initial[2], initial[6] = vehicle.depth_m, vehicle.speed_mps
    rpm = np.full(len(times), vehicle.rpm_per_mps * vehicle.speed_mps)
    return Manoeuvre("smooth", times, controls, rpm, initial)
