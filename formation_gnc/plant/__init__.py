"""Truth of chief and deputies, sensors, thrusters."""
