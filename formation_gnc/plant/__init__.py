"""Truth of chief and deputies: propagation, thrusters, sensor readings."""
