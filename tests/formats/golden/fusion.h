// Calibration of SN0042 (golden), for fusion.
// Exported by truetriad 0.1.0 at 2026-01-31T12:00:00Z; calibrated 2026-01-31T12:00:00Z.
// Gauge accel-x of the accelerometer.
// accelerometer: readings in counts, result in g.
// gyroscope: readings in counts, result in deg/s.
// magnetometer: readings in counts, result in uT.
// accelerometer: error of at most 0.13 m/s^2 (RMS 0.062) at a signal of 9.807, 2.7e+02 sigma.
// gyroscope: error of at most 0.00011 rad/s (RMS 0.0001) at a signal of 3.142.
// magnetometer: error of at most 8.2e-06 uT (RMS 3.1e-06) at a signal of 48.
// accelerometer: dropped: thermal terms of the matrix; used the values at 25 degC.
// accelerometer: dropped: thermal terms of the bias; used the values at 25 degC.
// gyroscope: dropped: g-sensitivity.
#include "Fusion.h"

static const FusionMatrix accelerometerMisalignment = {1.0f, 0.0f, 0.0f, -0.006065017f, 1.0f, 0.0f, 0.009105411f, -0.0038240917f, 1.0f};
static const FusionVector accelerometerSensitivity = {0.00048396594f, 0.0004947677f, 0.00048743605f};
static const FusionVector accelerometerOffset = {64.25f, -25.5f, 46.0f};
static const FusionMatrix gyroscopeMisalignment = {1.0f, -0.004043847f, 0.0059187254f, -0.0020567498f, 1.0f, -0.0050625894f, 0.002981113f, -0.007005004f, 1.0f};
static const FusionVector gyroscopeSensitivity = {0.06035102f, 0.06157133f, 0.060710758f};
static const FusionVector gyroscopeOffset = {10.5f, -5.75f, 3.8f};
static const FusionMatrix softIronMatrix = {0.14511564f, -0.0032565803f, 0.0018590798f, -0.0010426304f, 0.16199343f, -0.0053879283f, -0.0037397852f, 0.0030155098f, 0.15068437f};
static const FusionVector hardIronOffset = {80.6f, -201.5f, 50.05f};
