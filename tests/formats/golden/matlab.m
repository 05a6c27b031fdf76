% Calibration of SN0042 (golden), for matlab.
% Exported by truetriad 0.1.0 at 2026-01-31T12:00:00Z; calibrated 2026-01-31T12:00:00Z.
% Gauge accel-x of the accelerometer.
% accelerometer: readings in counts, result in m/s^2.
% gyroscope: readings in counts, result in rad/s.
% magnetometer: readings in counts, result in uT.
% accelerometer: error of at most 0.13 m/s^2 (RMS 0.062) at a signal of 9.807, 2.7e+02 sigma.
% gyroscope: error of at most 1.3e-15 rad/s (RMS 4.3e-16) at a signal of 3.142.
% magnetometer: error of at most 1.8e-14 uT (RMS 9.2e-15) at a signal of 48.
% accelerometer: dropped: thermal terms of the matrix; used the values at 25 degC.
% accelerometer: dropped: thermal terms of the bias; used the values at 25 degC.
accel.input_unit = 'counts';
accel.output_unit = 'm/s^2';
accel.C = [0.004746084480303749 0 0;
    -2.878508297127456e-05 0.0048520135856380394 0;
    4.321505056861445e-05 -1.855454526056612e-05 0.004780114722753346];
accel.b = [64.25;
    -25.5;
    46];
accel.S = [210.7 0 0;
    1.25 206.1 0;
    -1.9 0.8 209.2];
gyro.input_unit = 'counts';
gyro.output_unit = 'rad/s';
gyro.C = [0.0010533240118467725 -4.345608343989627e-06 6.271496954395716e-06;
    -2.166423800964835e-06 0.0010746224339219163 -5.364332922990476e-06;
    3.1400780146824865e-06 -7.52773444294111e-06 0.0010596026327492733];
gyro.b = [10.5;
    -5.75;
    3.8];
gyro.S = [949.4 3.8 -5.6;
    1.9 930.6 4.7;
    -2.8 6.6 943.8];
gyro.G = [0.01 0 0;
    0 0.01 0;
    0 0 0.01];
mag.input_unit = 'counts';
mag.output_unit = 'uT';
mag.C = [0.14511564375142696 -0.003256580315635379 0.0018590798144123588;
    -0.0010426303840935828 0.16199342250896764 -0.005387928112021173;
    -0.0037397850805179207 0.0030155097065964007 0.15068437482022737];
mag.b = [80.6;
    -201.5;
    50.05];
mag.S = [6.89 0.14 -0.08;
    0.05 6.17 0.22;
    0.17 -0.12 6.63];
A = [0.14511564375142696 -0.0010426303840935828 -0.0037397850805179207;
    -0.003256580315635379 0.16199342250896764 0.0030155097065964007;
    0.0018590798144123588 -0.005387928112021173 0.15068437482022737];
b = [80.6 -201.5 50.05];
expmfs = 48;
