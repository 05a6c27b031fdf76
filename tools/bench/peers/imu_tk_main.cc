// SPDX-License-Identifier: Apache-2.0
// Runs imu_tk's calibration on one of its own pairs of files and saves what it finds:
//
//   imu_tk_main ACC GYRO INITIAL_REST_S GRAVITY_MPS2 ACC_OFFSET GYRO_SCALE OUT_ACC OUT_GYRO
//
// ACC_OFFSET in counts and GYRO_SCALE in rad/s per count are start values, such as those in
// imu_tk's example apps/test_imu_calib.cpp. Here imu_tk's functions that plot and wait for a key do
// nothing, so that it needs no Qt and no OpenGL. tools/bench/peers.sh compiles this file with the
// sources of a checkout; none of them are in this file.
#include <cstdlib>
#include <iostream>
#include <vector>

#include "imu_tk/calibration.h"
#include "imu_tk/io_utils.h"
#include "imu_tk/visualization.h"

namespace imu_tk {

Plot::Plot() {}
template <typename T>
void Plot::plotIntervals(const std::vector<TriadData_<T>>&,
                         const std::vector<DataInterval>&,
                         DataInterval) {}
template void Plot::plotIntervals<double>(const std::vector<TriadData_<double>>&,
                                          const std::vector<DataInterval>&,
                                          DataInterval);
template void Plot::plotIntervals<float>(const std::vector<TriadData_<float>>&,
                                         const std::vector<DataInterval>&,
                                         DataInterval);
void waitForKey() {}

}  // namespace imu_tk

namespace {

// imu_tk's setter of the initial rest is declared to return a value but returns none. If g++
// optimises this setter, the program runs on into the next function. So the private member is set
// directly, to which an explicit instantiation has access.
void SetInitialRest(imu_tk::MultiPosCalibration& calibration, double duration_s);
template <double imu_tk::MultiPosCalibration::*member>
struct InitialRest {
  friend void SetInitialRest(imu_tk::MultiPosCalibration& calibration, double duration_s) {
    calibration.*member = duration_s;
  }
};
template struct InitialRest<&imu_tk::MultiPosCalibration::init_interval_duration_>;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 9) {
    std::cerr << "imu_tk_main ACC GYRO INITIAL_REST_S GRAVITY_MPS2 ACC_OFFSET GYRO_SCALE OUT_ACC "
                 "OUT_GYRO\n";
    return 1;
  }
  std::vector<imu_tk::TriadData> accelerometer, gyroscope;
  imu_tk::importAsciiData(argv[1], accelerometer, imu_tk::TIMESTAMP_UNIT_SEC);
  imu_tk::importAsciiData(argv[2], gyroscope, imu_tk::TIMESTAMP_UNIT_SEC);

  imu_tk::CalibratedTriad accelerometer_start, gyroscope_start;
  accelerometer_start.setBias(Eigen::Vector3d::Constant(std::atof(argv[5])));
  gyroscope_start.setScale(Eigen::Vector3d::Constant(std::atof(argv[6])));

  imu_tk::MultiPosCalibration calibration;
  SetInitialRest(calibration, std::atof(argv[3]));
  calibration.setGravityMagnitude(std::atof(argv[4]));
  calibration.setInitAccCalibration(accelerometer_start);
  calibration.setInitGyroCalibration(gyroscope_start);
  calibration.enableVerboseOutput(false);
  if (!calibration.calibrateAccGyro(accelerometer, gyroscope)) return 3;
  return calibration.getAccCalib().save(argv[7]) && calibration.getGyroCalib().save(argv[8]) ? 0
                                                                                             : 2;
}
