bool Enabled(const Motor& motor) {
  return motor.enable;
}
