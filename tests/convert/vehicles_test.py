#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From a vehicle's log to the parameters of all its sensors in one command, held against the truth.

Environment: PROGRAMS (folder of the converters), TRUETRIAD.
"""
import json
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import vehicles

PROGRAMS = Path(os.environ["PROGRAMS"])


def truetriad(*arguments):
    return subprocess.run([os.environ["TRUETRIAD"], *map(str, arguments)], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, encoding="utf-8", check=False)


class Vehicles(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.out = self.folder / "out"

    def tearDown(self):
        shutil.rmtree(self.folder)

    def log(self, writer, name, **how):
        converter = {"ulg": "ulog", "bin": "dataflash"}[name.split(".")[1]]
        if not (PROGRAMS / f"truetriad-convert-{converter}").exists():
            self.skipTest(f"the converter of {converter} was not built")
        if converter == "ulog" and shutil.which("node") is None:
            self.skipTest("Node is not installed")
        writer(self.folder / name, **how)
        return self.folder / name

    def calibrate(self, *arguments, code=0):
        done = truetriad("calibrate", *arguments, "-o", self.out)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def parameters(self, name, separator, at):
        lines = (self.out / name).read_text().splitlines()
        fields = [line.split(separator) for line in lines if line and not line.startswith("#")]
        found = {words[at]: float(words[at + 1]) for words in fields}
        self.assertEqual(len(found), len(fields), "a parameter is stated twice")
        return found

    def check_vector(self, parameters, prefix, suffix, expected, tolerance):
        for letter, value in zip("XYZ", expected):
            self.assertAlmostEqual(parameters[prefix + letter + suffix], value, delta=tolerance, msg=prefix + letter + suffix)

    def check_inertial(self, parameters, triad, offset, scale, suffix):
        # 24 rests of 300 readings of 0.02 m/s^2 leave less than 1 mm/s^2, gravity 0.2 % of the scale.
        self.check_vector(parameters, offset, suffix[0], triad.bias, 0.01)
        self.check_vector(parameters, scale, suffix[1], [1.0 / triad.matrix[i][i] for i in range(3)], 5e-3)

    def check_matrix(self, diagonal, off, triad):
        """The matrix times the truth is a multiple of one: nobody stated the field's strength."""
        (a, b, c), (d, e, f) = diagonal, off
        correction = [[a, d, e], [d, b, f], [e, f, c]]
        product = [[sum(correction[i][k] * triad.matrix[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
        for i in range(3):
            for j in range(3):
                self.assertAlmostEqual(product[i][j] / product[0][0], float(i == j), delta=5e-3)

    # ---------------------------------------------------------------------------------- PX4

    def test_a_ulog_becomes_the_parameters_of_all_its_sensors(self):
        log = self.log(vehicles.ulog, "flight.ulg")
        done = self.calibrate(log, "--to=px4")
        self.assertIn("(instance 0 of 3)", done.stdout.splitlines()[0])
        self.assertIn(f"Export:      {self.out}/px4.params", done.stdout)
        found = self.parameters("px4.params", "\t", 2)
        for i, triad in enumerate(vehicles.ACCELEROMETERS):
            self.assertEqual(found[f"CAL_ACC{i}_ID"], triad.number)
            self.check_inertial(found, triad, f"CAL_ACC{i}_", f"CAL_ACC{i}_", ("OFF", "SCALE"))
        for i, triad in enumerate(vehicles.GYROSCOPES):
            self.assertEqual(found[f"CAL_GYRO{i}_ID"], triad.number)
            self.check_vector(found, f"CAL_GYRO{i}_", "OFF", triad.bias, 1e-3)
        for i, triad in enumerate(vehicles.MAGNETOMETERS):
            self.assertEqual(found[f"CAL_MAG{i}_ID"], triad.number)
            self.check_vector(found, f"CAL_MAG{i}_", "OFF", triad.bias, 1e-3)
            self.check_matrix([found[f"CAL_MAG{i}_{axis}SCALE"] for axis in "XYZ"],
                              [found[f"CAL_MAG{i}_{axis}ODIAG"] for axis in "XYZ"], triad)
        self.assertNotIn("CAL_MAG2_ID", found)

    def test_the_numbers_of_sensors_go_with_each_result(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14)
        self.calibrate(log)
        for folder, i in ((self.out, 0), (self.out / "instance-1", 1), (self.out / "instance-2", 2)):
            ids = json.loads((folder / "calibration.json").read_text())["device"]["ids"]
            expected = {"accelerometer": vehicles.ACCELEROMETERS[i].number, "gyroscope": vehicles.GYROSCOPES[i].number}
            if i < 2:
                expected["magnetometer"] = vehicles.MAGNETOMETERS[i].number
            self.assertEqual(ids, expected)
        self.assertIn("input: \"recording/recording.yaml\"", (self.out / "experiment.yaml").read_text())
        calibration = self.out / "instance-1" / "calibration.yaml"
        for flags, number in (((), vehicles.ACCELEROMETERS[1].number), (("--id=accelerometer:17",), 17)):
            done = truetriad("export", calibration, "--to=ardupilot", "--instance=2", *flags, "--output", self.out / "one.param")
            self.assertEqual(done.returncode, 0, done.stderr)
            found = self.parameters("one.param", ",", 0)
            self.assertEqual(found["INS_ACC2_ID"], number)
            self.assertEqual(found["INS_GYR2_ID"], vehicles.GYROSCOPES[1].number)
        # Recordings of different sensors are no sessions of one.
        done = truetriad("calibrate", self.out / "recording/recording.yaml", self.out / "recording/recording-1.yaml",
                         "-o", self.folder / "mixed")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(f"is of the accelerometer {vehicles.ACCELEROMETERS[1].number}", done.stderr)

    def test_the_worst_instance_decides_and_one_alone_can_be_chosen(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14)
        # The biases are 0.31, 0.25 and 0.33 m/s^2; the third has no magnetometer, and its limits fall away.
        experiment = self.folder / "experiment.yaml"
        experiment.write_text("experiment: 1\nsensors: { accelerometer: {}, gyroscope: {}, magnetometer: { } }\n"
                              "reference: { field: { strength_ut: unknown, dip_deg: unknown } }\n"
                              "limits: { accelerometer.bias: 0.32, magnetometer.residual_rms: 2 }\n")
        done = self.calibrate(log, "-c", experiment, "--json", code=4)
        result = json.loads(done.stdout)["result"]
        self.assertEqual([one["exit"] for one in result["instances"]], [0, 0, 4])
        self.assertNotIn("magnetometer", result["config"]["sensors"])
        # The device may not leave by one of its sensors, whichever is exported.
        done = truetriad("export", self.out / "calibration.yaml", "--to=px4", "-o", self.out / "one.params")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("instance 2", done.stderr)
        shutil.rmtree(self.out)
        self.calibrate(log, "--instance=2", "--to=px4")
        self.assertFalse((self.out / "instance-2").exists())
        self.assertEqual(self.parameters("px4.params", "\t", 2)["CAL_ACC2_ID"], vehicles.ACCELEROMETERS[2].number)

    def test_a_refused_command_keeps_the_earlier_recording_and_a_failed_unit_no_export(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14)
        self.calibrate(log, "--to=px4,c-header")
        recording = self.out / "recording" / "recording.yaml"
        kept = recording.read_bytes(), recording.stat().st_mtime_ns
        self.calibrate(log, "--set=WRONG", code=1)
        cut = self.folder / "cut.ulg"
        cut.write_bytes(log.read_bytes()[:100])
        self.calibrate(cut, code=2)
        self.assertEqual((recording.read_bytes(), recording.stat().st_mtime_ns), kept)
        self.assertTrue((self.out / "px4.params").exists())
        self.calibrate(log, "--set=limits.accelerometer.bias=0.1", code=4)
        for name in ("px4.params", "calibration.h", "instance-1/calibration.h"):
            self.assertFalse((self.out / name).exists(), name)
            self.assertTrue((self.out / (name + ".withdrawn")).exists(), name)
        # One sensor alone may not leave, where another of the same device may not.
        shutil.rmtree(self.out)
        self.calibrate(log, "--set=limits.accelerometer.bias=0.32", code=4)
        self.calibrate(log, "--instance=0", "--to=px4", "--set=limits.accelerometer.bias=0.32", code=4)
        # Nor does one sensor take the place of another.
        self.calibrate(log, "--instance=1", code=2)
        self.assertFalse((self.out / "px4.params").exists())

    def test_the_recording_stays_with_its_calibration(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14)
        self.calibrate(log)
        recording, previous = self.out / "recording", self.out / "recording.previous"
        kept = (recording / "recording.yaml").read_bytes()
        # As a kill leaves it while the log is converted.
        recording.rename(self.out / "recording.aside")
        recording.mkdir()
        self.calibrate(log, "--set=WRONG", code=1)
        few = self.log(vehicles.ulog, "few.ulg", rests=1)
        self.calibrate(few, code=3)
        self.assertEqual((previous / "recording.yaml").read_bytes(), kept)
        self.assertTrue((self.out / "calibration.previous.yaml").exists())
        # That is not the last word about the vehicle.
        done = truetriad("export", self.out / "calibration.previous.yaml", "--to=px4", "-o", self.out / "p.params")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("a later recording", done.stderr)
        # A refusal leaves an empty folder of the user's where it is.
        own = self.folder / "own"
        own.mkdir()
        done = truetriad("calibrate", log, "--set=model=diagonal", "-o", own)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertTrue(own.exists())
        new = self.folder / "new"
        done = truetriad("calibrate", log, "--set=WRONG", "-o", new)
        self.assertEqual(done.returncode, 1)
        self.assertFalse(new.exists())

    def test_parameters_of_another_sensor_are_not_compared_with_it(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14)
        self.calibrate(log, "--to=px4")
        for instance, code in ((0, 0), (1, 2)):
            carried = self.folder / f"carried-{instance}.yaml"
            done = truetriad("import", self.out / "px4.params", "--from=px4", f"--instance={instance}",
                             "--units=m/s^2,rad/s,G", "-o", carried)
            self.assertEqual(done.returncode, 0, done.stderr)
            done = truetriad("evaluate", self.out / "calibration.yaml", carried, self.out / "recording/recording.yaml")
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertIn("has device id", done.stderr)

    def test_a_log_at_1_hz_is_named_as_too_slow(self):
        log = self.log(vehicles.ulog, "slow.ulg", rests=14, rest_s=12.0, turn_s=3.0, rate_hz=1)
        done = self.calibrate(log, code=3)
        self.assertIn("too slow for turns and rests", done.stdout)
        self.assertNotIn("ms as s", done.stdout)
        self.assertIn("too slow for a calibration; SDLOG_MODE 2 logs unarmed", done.stderr)
        self.assertIn("PX4 logs unarmed with SDLOG_MODE=2", done.stderr)

    def test_what_is_said_of_conversion_is_refused_where_nothing_is_converted(self):
        (self.folder / "log.csv").write_text("time[s],accel_x[g],accel_y[g],accel_z[g]\n0,0,0,1\n")
        done = self.calibrate(self.folder / "log.csv", "--units=g", code=1)
        self.assertIn("are for logs of other systems", done.stderr)

    # ---------------------------------------------------------------------------- ArduPilot

    def test_a_dataflash_log_becomes_the_parameters_of_all_its_sensors(self):
        log = self.log(vehicles.dataflash, "flight.bin")
        self.calibrate(log, "--to=ardupilot,c-header")
        found = self.parameters("ardupilot.param", ",", 0)
        for i, number in enumerate(("", "2", "3")):
            triad = vehicles.ACCELEROMETERS[i]
            self.assertEqual(found[f"INS_ACC{number}_ID"], triad.number)
            self.check_inertial(found, triad, f"INS_ACC{number}OFFS_", f"INS_ACC{number}SCAL_", ("", ""))
            self.assertEqual(found[f"INS_GYR{number}_ID"], vehicles.GYROSCOPES[i].number)
            self.check_vector(found, f"INS_GYR{number}OFFS_", "", vehicles.GYROSCOPES[i].bias, 1e-3)
        for i, number in enumerate(("", "2")):
            triad = vehicles.MAGNETOMETERS[i]
            self.assertEqual(found[f"COMPASS_DEV_ID{number}"], triad.number)
            # ArduPilot adds its offsets, which are in mG.
            self.check_vector(found, f"COMPASS_OFS{number}_", "", [-1e3 * b for b in triad.bias], 1.0)
            self.check_matrix([found[f"COMPASS_DIA{number}_{axis}"] for axis in "XYZ"],
                              [found[f"COMPASS_ODI{number}_{axis}"] for axis in "XYZ"], triad)
        for folder in (self.out, self.out / "instance-1", self.out / "instance-2"):
            self.assertTrue((folder / "calibration.h").exists())
        self.assertFalse((self.out / "instance-3").exists())
        # What was written can be read back, one instance at a time.
        done = truetriad("import", "--from=ardupilot", self.out / "ardupilot.param", "--instance=3",
                         "--output", self.folder / "carried.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
