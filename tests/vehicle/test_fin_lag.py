"""One step per period against the simulated servo's small steps."""

import numpy as np

from finlab.layout import Layout, Servo
from finlab.vehicle.fin_motion import FinLag, FinMotion


def test_it_follows_as_the_simulated_servo_does(layout_a: Layout) -> None:
    rng = np.random.default_rng(5)
    slow = Servo(amplitude_pole=3.0, frequency_pole=2.0, direction_pole=1.5)
    layout = layout_a.replace_actuator("back_left", servo=slow)
    lag, motion = FinLag(layout), FinMotion(layout)
    low, high = layout.lower, layout.upper
    for _ in range(40):
        command = low + rng.uniform(size=low.shape) * (high - low) * (0.9, 0.9, 0.5)
        for _ in range(10):
            motion.step(command, 0.01)
        lag.step(command, 0.1)
        np.testing.assert_allclose(lag.command, motion.command, atol=0.02)
    command[1] = np.nan
    motion.step(command, 0.1)
    lag.step(command, 0.1)
    still = lag.command
    np.testing.assert_allclose(still[1], motion.command[1], atol=0.02)
    assert still[1, 0] == still[1, 1] == 0.0 and lag.value[2][1] == still[1, 2]
