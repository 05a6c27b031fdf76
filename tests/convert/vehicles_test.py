#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From a vehicle's log to the parameters of all its sensors in one command, held against the truth.

Environment: PROGRAMS (folder of the converters), TRUETRIAD.
"""
import gzip
import json
import math
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
            done = truetriad("export", calibration, "--to=px4", "--instance=2", *flags, "--output", self.out / "one.params")
            self.assertEqual(done.returncode, 0, done.stderr)
            found = self.parameters("one.params", "\t", 2)
            self.assertEqual(found["CAL_ACC2_ID"], number)
            self.assertEqual(found["CAL_GYRO2_ID"], vehicles.GYROSCOPES[1].number)
        # Another firmware has other numbers for them.
        done = truetriad("export", calibration, "--to=ardupilot", "--output", self.out / "one.param")
        self.assertIn("uses other device ids", done.stderr)
        self.assertNotIn("INS_ACC_ID", self.parameters("one.param", ",", 0))
        # Recordings of different sensors are no sessions of one.
        done = truetriad("calibrate", self.out / "recording/recording.yaml", self.out / "recording/recording-1.yaml",
                         "-o", self.folder / "mixed")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(f"is a recording of the accelerometer {vehicles.ACCELEROMETERS[1].number}", done.stderr)

    def test_parameters_go_where_the_vehicle_has_the_number_of_a_sensor(self):
        acc, mag = vehicles.ACCELEROMETERS, vehicles.MAGNETOMETERS
        own = {"CAL_ACC0_ID": 555, "CAL_ACC1_ID": acc[0].number, "CAL_ACC2_ID": 0, "CAL_ACC3_ID": acc[1].number,
               "CAL_MAG0_ID": mag[1].number, "CAL_MAG0_ROT": 0, "CAL_MAG1_ID": 0, "CAL_MAG1_ROT": 2,
               "TC_A_ENABLE": 1, "TC_A0_ID": acc[1].number, "TC_A1_ID": 0, "TC_A2_ID": acc[0].number, "TC_A2_X0_0": 0.3}
        earlier = (("CAL_ACC0_ID", acc[0].number), ("CAL_ACC1_ID", acc[1].number), ("CAL_ACC3_ID", 0), ("CAL_MAG0_ID", 0),
                   ("TC_A_ENABLE", 0), ("TC_A0_ID", acc[0].number), ("TC_A2_ID", 0))
        log = self.log(vehicles.ulog, "flight.ulg", rests=14, parameters=own, earlier=earlier)
        done = self.calibrate(log, "--to=px4")
        found = self.parameters("px4.params", "\t", 2)
        for slot, i in ((1, 0), (3, 1), (2, 2)):  # The third sensor takes what is nobody's.
            self.assertEqual(found[f"CAL_ACC{slot}_ID"], acc[i].number)
            self.check_inertial(found, acc[i], f"CAL_ACC{slot}_", f"CAL_ACC{slot}_", ("OFF", "SCALE"))
        self.assertNotIn("CAL_ACC0_XOFF", found)
        self.assertEqual(found["CAL_MAG1_ID"], mag[0].number)
        self.check_vector(found, "CAL_MAG1_", "OFF", mag[0].bias, 1e-3)
        self.assertIn("its mounting is not known from the log; check CAL_MAG1_ROT", done.stderr)
        self.assertEqual(found["CAL_MAG0_ID"], mag[1].number)
        self.assertNotIn("CAL_MAG0_ROT", found)
        # The vehicle's terms of two of the sensors end; the third has none.
        self.assertIn("(TC_A_ENABLE); exported parameters replace this calibration (TC_A2_ID)", done.stderr)
        self.assertEqual([found.get(f"TC_A{slot}_ID") for slot in range(4)], [0, 0, 0, None])
        self.assertNotIn("TC_A2_X0_0", found)
        # A result knows where it belongs, and what it was made for.
        one = self.out / "one.params"
        done = truetriad("export", self.out / "instance-1" / "calibration.yaml", "--to=px4", "-o", one, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(json.loads(done.stdout)["findings"])
        alone = self.parameters("one.params", "\t", 2)
        self.assertEqual({name: found[name] for name in alone}, alone)
        done = truetriad("apply", self.out / "calibration.yaml", self.out / "recording/recording-1.yaml", "-o", self.out / "x.csv")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(f"has device id {acc[1].number}, but that of the calibration has {acc[0].number}", done.stderr)
        self.assertFalse((self.out / "x.csv").exists())
        # The vehicle's own calibration of the sensors is found by their numbers.
        vehicle = self.folder / "vehicle.params"
        vehicle.write_text("".join(f"1\t1\tCAL_ACC{slot}_{name}\t{value}\t{kind}\n" for slot, number, bias in
                                   ((0, 555, 1.0), (1, acc[0].number, 0.3)) for name, value, kind in
                                   (("ID", number, 6), ("XOFF", bias, 9))))
        done = truetriad("import", vehicle, "--from=px4", f"--id=accelerometer:{acc[0].number}", "-o", self.folder / "own.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = truetriad("evaluate", self.out / "calibration.yaml", self.folder / "own.yaml", self.out / "recording/recording.yaml")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_a_vehicle_with_no_place_for_a_sensor_says_so(self):
        gyroscopes = vehicles.GYROSCOPES
        own = {f"CAL_GYRO{n}_ID": number for n, number in enumerate((500, 501, gyroscopes[0].number, gyroscopes[2].number))}
        log = self.log(vehicles.ulog, "flight.ulg", rests=14, parameters=own)
        done = self.calibrate(log, "--to=px4", code=3)
        self.assertIn("instance 1: is not written: none of the log's CAL_GYRO0_ID to CAL_GYRO3_ID is free for the gyroscope: "
                      "each belongs to another sensor, or the log does not state this sensor's own id; state this id with --id", done.stderr)
        # The results are there, and the others are exported.
        self.assertTrue((self.out / "instance-1" / "calibration.yaml").exists())
        found = self.parameters("px4.params", "\t", 2)
        for slot, i in ((2, 0), (3, 2)):
            self.assertEqual(found[f"CAL_GYRO{slot}_ID"], gyroscopes[i].number)
        self.assertNotIn("CAL_ACC1_ID", found)

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

    def test_what_an_earlier_log_had_more_does_not_stay_beside(self):
        self.calibrate(self.log(vehicles.ulog, "three.ulg", rests=14))
        two = self.log(vehicles.ulog, "two.ulg", rests=14, accelerometers=2, gyroscopes=2)
        self.calibrate(two, "--instance=0")
        self.assertTrue((self.out / "instance-2").exists())
        done = self.calibrate(two, "--to=px4")
        self.assertIn("is renamed to instance-2.previous", done.stderr)
        self.assertFalse((self.out / "instance-2").exists())
        self.assertTrue((self.out / "instance-2.previous" / "calibration.yaml").exists())
        self.assertTrue((self.out / "instance-1" / "calibration.yaml").exists())

    def test_a_packed_log_is_to_be_unpacked(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=1)
        packed = self.folder / "flight.ulg.gz"
        packed.write_bytes(gzip.compress(log.read_bytes()))
        self.assertIn("is compressed with gzip, which is supported only for CSV; unpack it first: gunzip",
                      self.calibrate(packed, code=2).stderr)

    def test_corrections_that_are_not_known_are_said_in_one_line(self):
        log = self.log(vehicles.dataflash, "flight.bin", rests=14,
                       parameters={f"INS_{name}2OFFS_X": math.nan for name in ("ACC", "GYR")})
        done = self.calibrate(log, code=3)
        self.assertNotIn("u000A", done.stdout)
        for sensor in ("accelerometer", "gyroscope"):
            self.assertIn(f"applied.{sensor}: the corrections", " ".join(done.stdout.split()))

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
        self.assertIn("too slow for a calibration; SDLOG_MODE 2 logs while unarmed", done.stderr)
        self.assertIn("PX4 logs while unarmed if SDLOG_MODE=2", done.stderr)

    def test_a_log_at_5_hz_is_slow_enough_and_a_gap_does_not_matter(self):
        log = self.log(vehicles.ulog, "slow.ulg", rests=3, rest_s=5.0, turn_s=2.0, rate_hz=5)
        done = self.calibrate(log, code=3)
        self.assertNotIn("readings a second", done.stderr)
        long = self.log(vehicles.ulog, "long.ulg", rests=3, rate_hz=20, gap_s=300.0)
        done = self.calibrate(long, "--overwrite", code=3)
        self.assertNotIn("readings a second", done.stderr)

    def test_all_sensors_too_slow_are_named_where_some_have_no_gyroscope(self):
        log = self.log(vehicles.ulog, "slow.ulg", rests=24, rest_s=5.0, turn_s=2.0, rate_hz=1, gyroscopes=1)
        done = self.calibrate(log, "--json", code=3)
        codes = [(one["code"], one["values"]["instance"]["value"]) for one in json.loads(done.stdout)["findings"]
                 if one["severity"] == "refusal"]
        self.assertEqual(codes, [("too-slow", 0), ("too-slow", 1), ("too-slow", 2)])

    def test_a_compass_is_calibrated_in_its_own_axes_and_read_in_the_boards(self):
        # Yaw by 45 and 90 degrees, and roll by 180 degrees, as CAL_MAGn_ROT numbers them.
        half = math.sqrt(0.5)
        yaw = {f"CAL_MAG{i}_{angle}": degrees for i in range(2) for angle, degrees in (("ROLL", 0.0), ("PITCH", 0.0), ("YAW", 45.0))}
        for rotation, mounted in ((1, [[half, -half, 0], [half, half, 0], [0, 0, 1]]),
                                  (2, [[0, -1, 0], [1, 0, 0], [0, 0, 1]]), (8, [[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
                                  (100, [[half, -half, 0], [half, half, 0], [0, 0, 1]])):
            log = self.log(vehicles.ulog, f"{rotation}.ulg", rests=14, mounted=mounted,
                           parameters={f"CAL_MAG{i}_ROT": rotation for i in range(2)} | (yaw if rotation == 100 else {}))
            done = self.calibrate(log, "--to=px4", "--overwrite")
            self.assertNotIn("mounting", done.stdout)
            self.assertNotIn("swapped", done.stderr)
            found = self.parameters("px4.params", "\t", 2)
            triad = vehicles.MAGNETOMETERS[0]
            self.check_vector(found, "CAL_MAG0_", "OFF", triad.bias, 1e-3)
            self.check_matrix([found[f"CAL_MAG0_{axis}SCALE"] for axis in "XYZ"],
                              [found[f"CAL_MAG0_{axis}ODIAG"] for axis in "XYZ"], triad)
            if rotation == 100:
                continue
            # The vehicle's own parameters, its rotation among them, are of the same compass.
            full = self.folder / "full.params"
            full.write_text((self.out / "px4.params").read_text() + f"1\t1\tCAL_MAG0_ROT\t{rotation}\t6\n")
            done = truetriad("import", full, "--from=px4", "--units=m/s^2,rad/s,G", "-o", self.folder / "carried.yaml")
            self.assertEqual(done.returncode, 0, done.stderr)
            done = truetriad("evaluate", self.out / "calibration.yaml", self.folder / "carried.yaml",
                             self.out / "recording/recording.yaml")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_parameters_leave_no_correction_by_temperature_of_the_vehicles_own(self):
        own = {"TC_A_ENABLE": 1, "TC_A0_ID": vehicles.ACCELEROMETERS[0].number, "TC_A0_X0_0": 0.3, "TC_A0_TREF": 25.0}
        log = self.log(vehicles.ulog, "flight.ulg", rests=14, parameters=own)
        done = self.calibrate(log, "--to=px4")
        self.assertIn("vehicle's temperature calibration (TC_A_ENABLE)", done.stderr)
        found = self.parameters("px4.params", "\t", 2)
        self.assertEqual(found["TC_A0_ID"], 0)
        self.check_vector(found, "CAL_ACC0_", "OFF", vehicles.ACCELEROMETERS[0].bias, 0.01)

    def test_a_broken_sensor_is_named_and_the_others_are_exported(self):
        broken = {(topic, 2): (math.nan,) * 3 for topic in ("sensor_accel", "sensor_gyro")}
        broken |= {("sensor_accel", 0): (0.1, 0.2, -9.8), ("sensor_mag", 1): (math.nan,) * 3}
        log = self.log(vehicles.ulog, "flight.ulg", rests=14, broken=broken)
        done = self.calibrate(log, "--to=px4", "--json", code=3)
        refusals = [one for one in json.loads(done.stdout)["findings"] if one["severity"] == "refusal"]
        self.assertEqual([one["values"]["instance"]["value"] for one in refusals], [2], refusals)
        warnings = [one["text"] for one in json.loads(done.stdout)["findings"] if one["code"] == "no-readings"]
        self.assertIn("instance 1: magnetometer: ", warnings[0])
        stuck = [one["text"] for one in json.loads(done.stdout)["findings"] if one["code"] == "stuck-readings"]
        self.assertIn("instance 0: this sensor is left out", stuck[0])
        self.assertIn("the sensor is stuck", stuck[0])
        found = self.parameters("px4.params", "\t", 2)
        self.check_vector(found, "CAL_GYRO0_", "OFF", vehicles.GYROSCOPES[0].bias, 1e-3)
        self.assertEqual(found["CAL_ACC1_ID"], vehicles.ACCELEROMETERS[1].number)
        self.assertNotIn("CAL_ACC0_XOFF", found)
        self.assertNotIn("CAL_ACC2_XOFF", found)
        # Alone it is the same; with limits it is not passed, and what an error names is said to be gone.
        self.calibrate(log, "--instance=0", "--overwrite", code=3)
        done = self.calibrate(log, "--instance=0", "--overwrite", "--set=limits.gyroscope.bias=1", code=2)
        self.assertIn("this recording was temporary", done.stderr)

    def test_no_later_result_takes_the_place_of_one_with_more(self):
        good = self.log(vehicles.ulog, "good.ulg", rests=14)
        stuck = self.log(vehicles.ulog, "stuck.ulg", rests=14, broken={("sensor_accel", 0): (0.1, 0.2, -9.8)})
        few = self.log(vehicles.ulog, "few.ulg", rests=1)
        self.calibrate(good, "--instance=0", "--to=px4")
        whole = (self.out / "calibration.yaml").read_bytes()
        kept = (self.out / "recording" / "recording.yaml").read_bytes()
        for log in (stuck, stuck, few, stuck, few):
            self.calibrate(log, "--instance=0", code=3)
            self.assertEqual((self.out / "calibration.previous.yaml").read_bytes(), whole)
            self.assertEqual((self.out / "recording.previous" / "recording.yaml").read_bytes(), kept)
        # The second does not replace the first, and stays itself.
        self.assertNotIn("accelerometer", json.loads((self.out / "calibration.previous-2.json").read_text())["sensors"])
        # What is written beside a result without a sensor calibrates without it.
        self.calibrate(stuck, "--instance=0", code=3)
        self.assertNotIn("accelerometer:", (self.out / "experiment.yaml").read_text().replace("# limits", ""))
        # Nor does what is imported, however often.
        self.out = self.folder / "imported"
        self.calibrate(good, "--instance=0", "--to=px4")
        whole = (self.out / "calibration.yaml").read_bytes()
        for _ in range(3):
            done = truetriad("import", self.out / "px4.params", "--from=px4", f"--output={self.out}", "--overwrite")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((self.out / "calibration.previous.yaml").read_bytes(), whole)

    def test_sensors_that_only_a_later_log_has_are_in_the_experiment(self):
        none = self.log(vehicles.ulog, "nomag.ulg", rests=14, absent=[("sensor_mag", 0), ("sensor_mag", 1)], accelerometers=1, gyroscopes=1)
        with_one = self.log(vehicles.ulog, "mag.ulg", rests=14, absent=[("sensor_mag", 1)], accelerometers=1, gyroscopes=1)
        self.calibrate(none, with_one)
        first = json.loads((self.out / "calibration.json").read_text())["sensors"]
        experiment, self.out = self.out / "experiment.yaml", self.folder / "again"
        self.calibrate(f"--config={experiment}")
        self.assertEqual(json.loads((self.out / "calibration.json").read_text())["sensors"], first)
        self.assertIn("magnetometer", first)

    def test_idle_terms_of_other_sensors_stay_out_of_use(self):
        numbers = [triad.number for triad in vehicles.ACCELEROMETERS]
        log = self.log(vehicles.ulog, "flight.ulg", rests=14,
                       parameters={"TC_A_ENABLE": 0, "TC_A2_ID": 999} | {f"TC_A{n}_ID": number for n, number in enumerate(numbers[:2])})
        self.calibrate(log, "--instance=0")
        # Those of another sensor of the log are replaced with its own result.
        self.assertIn("idle_thermal_slots: { accelerometer: [0, 2] }", (self.out / "calibration.yaml").read_text())
        on = self.log(vehicles.ulog, "on.ulg", rests=14, parameters={"TC_A_ENABLE": 1, "TC_A1_ID": numbers[1]})
        self.calibrate(on, "--instance=0", "--overwrite")
        self.assertNotIn("idle_thermal_slots", (self.out / "calibration.yaml").read_text())

    def test_what_is_imported_takes_the_place_of_no_result_silently(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14)
        self.calibrate(log, "--to=px4")
        # Of nobody by its serial number.
        text = (self.out / "calibration.yaml").read_text()
        (self.out / "calibration.yaml").write_text(text.replace(f'serial: "{vehicles.SERIAL}"', 'serial: ""', 1))
        vehicle, result = self.folder / "vehicle.params", (self.out / "calibration.yaml").read_text()
        vehicle.write_text((self.out / "px4.params").read_text())
        for target in (self.out, self.out / "calibration.yaml"):
            done = truetriad("import", vehicle, "--from=px4", "--instance=1", "-o", target)
            self.assertEqual(done.returncode, 2, done.stdout)
            self.assertIn("replace it with --overwrite", done.stderr)
        self.assertEqual((self.out / "calibration.yaml").read_text(), result)
        done = truetriad("import", vehicle, "--from=px4", "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("calibration.yaml to calibration.previous.yaml", done.stderr)
        self.assertEqual((self.out / "calibration.previous.yaml").read_text(), result)
        self.assertFalse((self.out / "report.html").exists())

    def test_each_instance_is_asked_for_its_own_sensors(self):
        for topic, kind, triads in (("sensor_accel", "ACC", vehicles.ACCELEROMETERS), ("sensor_gyro", "GYRO", vehicles.GYROSCOPES),
                                    ("sensor_mag", "MAG", vehicles.MAGNETOMETERS)):
            log = self.log(vehicles.ulog, f"{kind}.ulg", rests=14, absent={(topic, 0)},
                           parameters={f"CAL_{kind}{i}_ID": triad.number for i, triad in enumerate(triads)})
            # What is stated of a sensor holds for those that have one.
            sensor = {"ACC": "accelerometer", "GYRO": "gyroscope", "MAG": "magnetometer"}[kind]
            self.calibrate(log, "--to=px4", "--overwrite", f"--set=sensors.{sensor}.model=full")
            found = self.parameters("px4.params", "\t", 2)
            self.assertNotIn(f"CAL_{kind}0_ID", found)
            for i, triad in list(enumerate(triads))[1:]:
                self.assertEqual(found[f"CAL_{kind}{i}_ID"], triad.number)
                self.check_vector(found, f"CAL_{kind}{i}_", "OFF", triad.bias, 0.01)
        # Nor does it matter which of several logs has a sensor.
        whole = self.log(vehicles.ulog, "whole.ulg", rests=14, rest_s=3.2,
                         parameters={f"CAL_MAG{i}_ID": triad.number for i, triad in enumerate(vehicles.MAGNETOMETERS)})
        self.calibrate(log, whole, "--to=px4", "--overwrite")
        self.check_vector(self.parameters("px4.params", "\t", 2), "CAL_MAG0_", "OFF", vehicles.MAGNETOMETERS[0].bias, 1e-3)
        # One that has nothing of what is asked for is left out.
        self.calibrate(log, "--overwrite", "--set=sensors={magnetometer: {}}")
        found = json.loads((self.out / "calibration.json").read_text())
        self.assertEqual(list(found["sensors"]), ["magnetometer"])
        self.assertEqual(found["device"]["ids"]["magnetometer"], vehicles.MAGNETOMETERS[1].number)

    def test_a_broken_sensor_does_not_take_the_others_of_its_instance_along(self):
        acc = vehicles.ACCELEROMETERS
        log = self.log(vehicles.ulog, "flight.ulg", rests=14, broken={("sensor_accel", 1): (0.0, 0.0, 0.0)})
        done = self.calibrate(log, "--to=px4", "--json", code=3)
        said = json.loads(done.stdout)
        self.assertEqual([one["exit"] for one in said["result"]["instances"]], [0, 3, 0])
        self.assertEqual(said["result"]["instances"][1]["ids"]["accelerometer"], acc[1].number)
        lost = [one for one in said["findings"] if one.get("sensor") == "accelerometer" and "left out" in one["text"]]
        self.assertEqual([one["values"]["instance"]["value"] for one in lost], [1])
        found = self.parameters("px4.params", "\t", 2)
        self.check_vector(found, "CAL_GYRO1_", "OFF", vehicles.GYROSCOPES[1].bias, 1e-3)
        self.check_vector(found, "CAL_MAG1_", "OFF", vehicles.MAGNETOMETERS[1].bias, 1e-3)
        self.assertNotIn(acc[1].number, [found.get(f"CAL_ACC{n}_ID") for n in range(4)])
        # With limits a device that has a broken sensor has no verdict by the others.
        done = self.calibrate(log, "--overwrite", "--set=limits.magnetometer.residual_rms=2", "--json", code=3)
        self.assertEqual([one["verdict"] for one in json.loads(done.stdout)["result"]["instances"]],
                         ["PASS", "NO_RESULT", "NO_LIMITS"])
        # A gyroscope whose offsets changed, of the first instance.
        log = self.log(vehicles.dataflash, "flight.bin", rests=14, later={"INS_GYROFFS_X": 0.01})
        done = self.calibrate(log, "--to=ardupilot", "--overwrite", code=3)
        found = self.parameters("ardupilot.param", ",", 0)
        self.assertEqual(found["INS_ACC_ID"], acc[0].number)
        self.assertNotIn("INS_GYR_ID", found)

    def test_a_sensor_that_is_mounted_turned_is_named_and_losses_are_one_line(self):
        c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
        log = self.log(vehicles.ulog, "flight.ulg", rests=14, mounted=[[c, -s, 0], [s, c, 0], [0, 0, 1]])
        done = self.calibrate(log, "--to=px4", "--json", code=3)
        said = json.loads(done.stdout)
        # Loaded, it would turn the compass of a vehicle.
        self.assertNotIn("CAL_MAG0_ID", self.parameters("px4.params", "\t", 2))
        self.assertIn("# Instance 1: its magnetometer is not written: it is rotated", (self.out / "px4.params").read_text())
        turned = [(one["sensor"], one["values"]["instance"]["value"]) for one in said["findings"]
                  if one["severity"] == "warning" and "cannot hold this rotation" in one["text"]]
        self.assertEqual(turned, [("magnetometer", 0), ("magnetometer", 1)])
        self.assertEqual(sum("exceeds the calibration's uncertainty" in one for one in said["result"]["export_warnings"]), 1)
        log = self.log(vehicles.ulog, "straight.ulg", rests=14)
        done = self.calibrate(log, "--to=px4", "--overwrite")
        self.assertNotIn("no such turn", done.stdout + done.stderr)
        self.assertEqual(done.stderr.count("exceeds the calibration's uncertainty"), 1)
        done = truetriad("export", self.out / "calibration.yaml", "--to=px4", "--instance=2", "--id=gyroscope:12345", "-o", self.out / "one.params")
        self.assertIn("accelerometer: according to the log, the vehicle has the parameters of this sensor under the number 0, but --instance=2 is stated", done.stderr)
        self.assertIn("but --id states 12345, which is another sensor's", done.stderr)

    def test_a_sensor_without_a_number_takes_no_other_ones_place(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14, parameters={"CAL_ACC0_ID": 555, "CAL_ACC1_ID": 0},
                       nameless=(("sensor_accel", 0), ("sensor_accel", 1)))
        done = self.calibrate(log, "--to=px4", code=3)
        self.assertIn("instance 0: is not written: none of the log's CAL_ACC0_ID to CAL_ACC3_ID is free for the accelerometer", done.stderr)
        found = self.parameters("px4.params", "\t", 2)
        self.assertNotIn("CAL_ACC0_XOFF", found)
        self.assertIn("CAL_ACC1_XOFF", found)

    def test_readings_of_two_units_hold_back_all_sensors(self):
        logs = [self.log(vehicles.ulog, f"{unit}.ulg", rests=14, gains=gains)
                for unit, gains in ((0, (1.0, 1.0, 1.0)), (1, (1.03, 0.96, 1.02)))]
        done = self.calibrate(*logs, "--to=px4", code=3)
        self.assertIn("these are readings of two units", done.stdout)
        self.assertFalse((self.out / "px4.params").exists())
        third = json.loads((self.out / "instance-2" / "calibration.json").read_text())
        self.assertEqual(third["verdict"], "FAIL")

    def test_what_is_no_calibration_is_moved_aside(self):
        self.out.mkdir()
        (self.out / "calibration.yaml").write_text("mine")
        self.calibrate(self.log(vehicles.ulog, "flight.ulg", rests=14))
        self.assertEqual((self.out / "calibration.previous.yaml").read_text(), "mine")

    def test_logs_that_were_joined_are_refused_by_name(self):
        for writer, name in ((vehicles.ulog, "flight.ulg"), (vehicles.dataflash, "flight.bin")):
            log = self.log(writer, name, rests=2)
            whole = log.read_bytes()
            # The last message is cut after a power cut, and the next log's begin seems to be the rest of it.
            for cut in (0, 1, 7, 40):
                log.write_bytes(whole[:len(whole) - cut] + whole)
                self.assertIn(f"another log begins at byte {len(whole) - cut}: ", self.calibrate(log, code=2).stderr, cut)

    def test_rows_before_the_first_temperature_are_left_out_where_it_corrects(self):
        log = self.log(vehicles.dataflash, "flight.bin", rests=14, early=3, parameters={
            "INS_TCAL1_ENABLE": 1, "INS_TCAL1_TMIN": 0, "INS_TCAL1_TMAX": 70, "INS_ACC1_CALTEMP": 30, "INS_GYR1_CALTEMP": 30} |
            {f"INS_TCAL1_{kind}{power}_{axis}": 1000 if f"{kind}{power}{axis}" == "ACC1X" else 0
             for kind in ("ACC", "GYR") for power in (1, 2, 3) for axis in "XYZ"})
        done = self.calibrate(log, "--to=ardupilot")
        self.assertIn("4 rows before the first temperature skipped", done.stderr)

    def test_a_position_has_its_gravity(self):
        log = self.log(vehicles.ulog, "flight.ulg", rests=14)
        self.calibrate(log, "--set=reference.position={ latitude_deg: 60, longitude_deg: 25, height_m: 0, date: 2026-01-31 }")
        reference = json.loads((self.out / "calibration.json").read_text())["reference"]
        self.assertAlmostEqual(reference["gravity_mps2"], 9.8191, delta=1e-3)

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
        # Of other temperatures than this one nothing is known: the firmware's own terms are zero here.
        self.assertEqual(found["INS_ACC2_CALTEMP"], 40)
        # What was written can be read back, one instance at a time.
        done = truetriad("import", "--from=ardupilot", self.out / "ardupilot.param", "--instance=3",
                         "--output", self.folder / "carried.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_compass_that_is_turned_while_it_is_logged_is_refused_by_name(self):
        log = self.log(vehicles.dataflash, "flight.bin", rests=14, parameters={"COMPASS_ORIENT2": 0, "COMPASS_EXTERN2": 1},
                       later={"COMPASS_ORIENT2": 2})
        done = self.calibrate(log, code=3)
        self.assertIn("magnetometer: firmware correction unknown: COMPASS_ORIENT2 changed during the log", done.stderr)
        self.assertIn("(instance 1 of 3, without its magnetometer)", done.stdout.splitlines()[0])

    def test_compasses_of_two_logs_are_one_where_what_turned_them_is_undone(self):
        turned = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        first = self.log(vehicles.dataflash, "first.bin", rests=14)
        second = self.log(vehicles.dataflash, "second.bin", rests=14, board=turned, on_board=True, parameters={"AHRS_ORIENTATION": 2})
        done = self.calibrate(first, second, "--to=ardupilot")
        self.assertNotIn("without its", done.stdout)
        x, y, z = vehicles.MAGNETOMETERS[1].bias
        self.check_vector(self.parameters("ardupilot.param", ",", 0), "COMPASS_OFS2_", "", [1e3 * y, -1e3 * x, -1e3 * z], 1.0)
        # One that is external is turned by its own parameter, and its readings with it.
        for orient, code in ((0, 0), (2, 3)):
            logs = [self.log(vehicles.dataflash, f"{rests}.bin", rests=rests, rest_s=0.2 * rests,
                             parameters={"COMPASS_EXTERN2": 1, "COMPASS_ORIENT2": n}) for rests, n in ((14, 0), (15, orient))]
            done = self.calibrate(*logs, "--overwrite", code=code)
            self.assertEqual("turned against the board by (roll, pitch, yaw) 0, 0, 90 deg" in " ".join(done.stdout.split()), code == 3)

    def test_compasses_are_logged_by_priority_and_corrected_by_number(self):
        first, second = vehicles.MAGNETOMETERS
        own = {"COMPASS_DEV_ID": second.number, "COMPASS_DEV_ID2": first.number, "COMPASS_PRIO1_ID": first.number,
               "COMPASS_PRIO2_ID": second.number, "COMPASS_PRIO3_ID": 0, "COMPASS_OFS_X": 70.0, "COMPASS_OFS2_X": -40.0}
        log = self.log(vehicles.dataflash, "flight.bin", rests=14, parameters=own)
        self.calibrate(log, "--to=ardupilot")
        found = self.parameters("ardupilot.param", ",", 0)
        for number, triad in (("", second), ("2", first)):
            self.assertEqual(found[f"COMPASS_DEV_ID{number}"], triad.number)
            self.check_vector(found, f"COMPASS_OFS{number}_", "", [-1e3 * b for b in triad.bias], 1.0)
            self.check_matrix([found[f"COMPASS_DIA{number}_{axis}"] for axis in "XYZ"],
                              [found[f"COMPASS_ODI{number}_{axis}"] for axis in "XYZ"], triad)
        # A compass that has no parameters was not corrected by anybody's.
        log = self.log(vehicles.dataflash, "other.bin", rests=14, parameters=own | {"COMPASS_DEV_ID2": 17})
        done = truetriad("calibrate", log, "-o", self.folder / "other")
        self.assertIn("no COMPASS_DEV_ID equals COMPASS_PRIO1_ID", done.stderr)

    def test_each_sensor_is_corrected_where_the_firmware_does_it(self):
        turned = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        own = {"AHRS_ORIENTATION": 2, "INS_TCAL1_ENABLE": 1, "INS_TCAL1_TMIN": 0, "INS_TCAL1_TMAX": 70,
               "INS_ACC1_CALTEMP": 25, "INS_GYR1_CALTEMP": 25}
        own |= {f"INS_TCAL1_{sensor}{power}_{axis}": 0 for sensor in ("ACC", "GYR") for power in "123" for axis in "XYZ"}
        own["INS_TCAL1_ACC1_X"] = 5000
        log = self.log(vehicles.dataflash, "flight.bin", board=turned, parameters=own)
        done = self.calibrate(log, "--to=ardupilot")
        self.assertNotIn("mounting", done.stdout)
        self.assertNotIn("swapped", done.stderr)
        self.assertNotIn("where the recording's axes are the vehicle's", done.stderr)
        found = self.parameters("ardupilot.param", ",", 0)
        self.check_inertial(found, vehicles.ACCELEROMETERS[0], "INS_ACCOFFS_", "INS_ACCSCAL_", ("", ""))
        # With its own terms on, they are zero at the temperature of the calibration.
        self.assertEqual(found["INS_ACC1_CALTEMP"], 40)
        self.assertEqual(found["INS_GYR1_CALTEMP"], 40)
        triad = vehicles.MAGNETOMETERS[0]
        self.check_vector(found, "COMPASS_OFS_", "", [-1e3 * b for b in triad.bias], 1.0)
        self.check_matrix([found[f"COMPASS_DIA_{axis}"] for axis in "XYZ"],
                          [found[f"COMPASS_ODI_{axis}"] for axis in "XYZ"], triad)


if __name__ == "__main__":
    unittest.main()
