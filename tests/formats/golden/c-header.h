/* Calibration of SN0042 (golden), for c-header.
 * Exported by truetriad 0.1.0 at 2026-01-31T12:00:00Z; calibrated 2026-01-31T12:00:00Z.
 * Gauge accel-x of the accelerometer.
 * accelerometer: readings in counts, result in m/s^2.
 * gyroscope: readings in counts, result in rad/s.
 * magnetometer: readings in counts, result in uT.
 * accelerometer: error of at most 1.9e-06 m/s^2 (RMS 5.9e-07) at a signal of 9.807, 0.0039 sigma.
 * gyroscope: error of at most 5.1e-07 rad/s (RMS 2.2e-07) at a signal of 3.142.
 * magnetometer: error of at most 8.2e-06 uT (RMS 3.1e-06) at a signal of 48.
 *
 * truth = C(u) (raw - b(u)), for the gyroscope C(u) (raw - b(u) - G force),
 * u = (clamp(temperature, low, high) - reference) * per_degc. C99 or C++.
 */
#ifndef TRUETRIAD_CALIBRATION_H
#define TRUETRIAD_CALIBRATION_H

#include <stdint.h>

/* accelerometer: truth [m/s^2] from raw [counts]. b raw, C by rows. */
/* reference, low, high [degC], per_degc; b_T and C_T: powers 1, 2, ... of u. */
static const float truetriad_accelerometer_T[4] =
    {25.0f, -10.0f, 60.0f, 0.015625f};
static const float truetriad_accelerometer_b[3] =
    {64.25f, -25.5f, 46.0f};
static const float truetriad_accelerometer_b_T[2][3] = {
    {16.0f, -8.0f, 32.0f},
    {8.192f, 4.096f, -12.288f}};
static const float truetriad_accelerometer_C[9] =
    {0.0047460846f, 0.0f, 0.0f, -2.8785083e-05f, 0.0048520137f,
     0.0f, 4.3215052e-05f, -1.8554545e-05f, 0.0047801146f};
static const float truetriad_accelerometer_C_T[2][9] = {
    {-1.4416233e-05f, 0.0f, 0.0f, 2.6620936e-07f, -3.0134066e-05f,
     0.0f, 2.5755206e-10f, 5.847164e-08f, 1.4623709e-05f},
    {4.3789225e-08f, 0.0f, 0.0f, -1.9188962e-09f, 1.8714995e-07f,
     0.0f, 4.0582923e-10f, -5.367979e-10f, 4.4737924e-08f}};

/* gyroscope: truth [rad/s] from raw [counts]. b raw, C by rows, G raw per m/s^2 by rows. */
static const float truetriad_gyroscope_b[3] =
    {10.5f, -5.75f, 3.8f};
static const float truetriad_gyroscope_C[9] =
    {0.001053324f, -4.3456084e-06f, 6.271497e-06f, -2.1664239e-06f, 0.0010746224f,
     -5.364333e-06f, 3.140078e-06f, -7.5277344e-06f, 0.0010596026f};
static const float truetriad_gyroscope_G[9] =
    {0.01f, 0.0f, 0.0f, 0.0f, 0.01f,
     0.0f, 0.0f, 0.0f, 0.01f};

/* magnetometer: truth [uT] from raw [counts]. b raw, C by rows. */
static const float truetriad_magnetometer_b[3] =
    {80.6f, -201.5f, 50.05f};
static const float truetriad_magnetometer_C[9] =
    {0.14511564f, -0.0032565803f, 0.0018590798f, -0.0010426304f, 0.16199343f,
     -0.0053879283f, -0.0037397852f, 0.0030155098f, 0.15068437f};

/* CRC-32 (as of zip) of all numbers above in order, float32, low byte first. */
#define TRUETRIAD_CALIBRATION_CRC32 0x48ddaa35u

/* terms[0] u + terms[stride] u^2 + ... */
static inline float truetriad_polynomial(const float *terms, int count, int stride, float u) {
  float sum = 0.0f;
  int k;
  for (k = count - 1; k >= 0; --k) sum = (sum + terms[k * stride]) * u;
  return sum;
}

static inline void truetriad_accelerometer_correct(const float raw[3], float temperature_degc, float truth[3]) {
  float reading[3];
  int i, j;
  float u = temperature_degc < truetriad_accelerometer_T[1] ? truetriad_accelerometer_T[1] : temperature_degc;
  u = ((u > truetriad_accelerometer_T[2] ? truetriad_accelerometer_T[2] : u) - truetriad_accelerometer_T[0]) * truetriad_accelerometer_T[3];
  for (i = 0; i < 3; ++i) {
    reading[i] = raw[i] - (truetriad_accelerometer_b[i] + truetriad_polynomial(&truetriad_accelerometer_b_T[0][i], 2, 3, u));
  }
  for (i = 0; i < 3; ++i) {
    truth[i] = 0.0f;
    for (j = 0; j < 3; ++j) {
      truth[i] += (truetriad_accelerometer_C[3 * i + j] + truetriad_polynomial(&truetriad_accelerometer_C_T[0][3 * i + j], 2, 9, u)) * reading[j];
    }
  }
}

static inline void truetriad_gyroscope_correct(const float raw[3], const float force_mps2[3],
    float temperature_degc, float truth[3]) {
  float reading[3];
  int i, j;
  (void)temperature_degc;
  for (i = 0; i < 3; ++i) {
    reading[i] = raw[i] - (truetriad_gyroscope_b[i]);
    for (j = 0; j < 3; ++j) reading[i] -= truetriad_gyroscope_G[3 * i + j] * force_mps2[j];
  }
  for (i = 0; i < 3; ++i) {
    truth[i] = 0.0f;
    for (j = 0; j < 3; ++j) {
      truth[i] += (truetriad_gyroscope_C[3 * i + j]) * reading[j];
    }
  }
}

static inline void truetriad_magnetometer_correct(const float raw[3], float temperature_degc, float truth[3]) {
  float reading[3];
  int i, j;
  (void)temperature_degc;
  for (i = 0; i < 3; ++i) {
    reading[i] = raw[i] - (truetriad_magnetometer_b[i]);
  }
  for (i = 0; i < 3; ++i) {
    truth[i] = 0.0f;
    for (j = 0; j < 3; ++j) {
      truth[i] += (truetriad_magnetometer_C[3 * i + j]) * reading[j];
    }
  }
}

static inline uint32_t truetriad_crc32(uint32_t crc, const float *numbers, uint32_t count) {
  uint32_t i, j, bits = 0;
  crc = ~crc;
  for (i = 0; i < count; ++i) {
    const unsigned char *from = (const unsigned char *)&numbers[i];
    unsigned char *to = (unsigned char *)&bits;
    for (j = 0; j < 4; ++j) to[j] = from[j];
    for (j = 0; j < 32; ++j) {
      crc ^= (bits >> j) & 1u;
      crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1u)));
    }
  }
  return ~crc;
}

static inline uint32_t truetriad_calibration_crc32(void) {
  uint32_t crc = 0;
  crc = truetriad_crc32(crc, truetriad_accelerometer_T, 4u);
  crc = truetriad_crc32(crc, truetriad_accelerometer_b, 3u);
  crc = truetriad_crc32(crc, &truetriad_accelerometer_b_T[0][0], 6u);
  crc = truetriad_crc32(crc, truetriad_accelerometer_C, 9u);
  crc = truetriad_crc32(crc, &truetriad_accelerometer_C_T[0][0], 18u);
  crc = truetriad_crc32(crc, truetriad_gyroscope_b, 3u);
  crc = truetriad_crc32(crc, truetriad_gyroscope_C, 9u);
  crc = truetriad_crc32(crc, truetriad_gyroscope_G, 9u);
  crc = truetriad_crc32(crc, truetriad_magnetometer_b, 3u);
  crc = truetriad_crc32(crc, truetriad_magnetometer_C, 9u);
  return crc;
}

/* Each row: raw x y z, force x y z [m/s^2], temperature [degC], expected truth x y z. */
static const float truetriad_accelerometer_test[3][10] = {
    {1295.6473f, -979.4022f, 1325.0691f, 0.0f, 0.0f,
     0.0f, -10.0f, 5.88399f, -4.707192f, 6.276256f},
    {-679.604f, 940.23926f, 1697.7145f, 0.0f, 0.0f,
     0.0f, 25.0f, -3.530394f, 4.707192f, 7.84532f},
    {654.9642f, 1142.9191f, -1513.8285f, 0.0f, 0.0f,
     0.0f, 60.0f, 2.745862f, 5.6486306f, -7.531507f}};
static const float truetriad_gyroscope_test[3][10] = {
    {574.77905f, -448.22723f, 602.9252f, 4.707192f, 6.276256f,
     -5.88399f, 25.0f, 0.6f, -0.48f, 0.64f},
    {-333.8929f, 444.07675f, 762.95715f, 4.707192f, 6.276256f,
     -5.88399f, 25.0f, -0.36f, 0.48f, 0.8f},
    {282.86868f, 527.26074f, -718.07965f, 4.707192f, 6.276256f,
     -5.88399f, 25.0f, 0.28f, 0.576f, -0.768f}};
static const float truetriad_magnetometer_test[3][10] = {
    {273.3488f, -335.4584f, 261.3844f, 0.0f, 0.0f,
     0.0f, 25.0f, 28.8f, -23.04f, 30.72f},
    {-38.3056f, -51.7592f, 298.9396f, 0.0f, 0.0f,
     0.0f, 25.0f, -17.28f, 23.04f, 38.4f},
    {180.02144f, -38.34992f, -195.39128f, 0.0f, 0.0f,
     0.0f, 25.0f, 13.44f, 27.648f, -36.864f}};

/* Returns 1 if the CRC is right and every row above gives the expected truth. */
static inline int truetriad_self_test(void) {
  float truth[3], error;
  int i, j;
  if (truetriad_calibration_crc32() != TRUETRIAD_CALIBRATION_CRC32) return 0;
  for (i = 0; i < 3; ++i) {
    truetriad_accelerometer_correct(&truetriad_accelerometer_test[i][0], truetriad_accelerometer_test[i][6], truth);
    for (j = 0; j < 3; ++j) {
      error = truth[j] - truetriad_accelerometer_test[i][7 + j];
      if (!(error <= 3.6495305e-05f && error >= -3.6495305e-05f)) return 0;
    }
  }
  for (i = 0; i < 3; ++i) {
    truetriad_gyroscope_correct(&truetriad_gyroscope_test[i][0], &truetriad_gyroscope_test[i][3], truetriad_gyroscope_test[i][6], truth);
    for (j = 0; j < 3; ++j) {
      error = truth[j] - truetriad_gyroscope_test[i][7 + j];
      if (!(error <= 3.6241197e-06f && error >= -3.6241197e-06f)) return 0;
    }
  }
  for (i = 0; i < 3; ++i) {
    truetriad_magnetometer_correct(&truetriad_magnetometer_test[i][0], truetriad_magnetometer_test[i][6], truth);
    for (j = 0; j < 3; ++j) {
      error = truth[j] - truetriad_magnetometer_test[i][7 + j];
      if (!(error <= 0.0002999885f && error >= -0.0002999885f)) return 0;
    }
  }
  return 1;
}

#endif
