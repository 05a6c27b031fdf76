// SPDX-License-Identifier: Apache-2.0
// Makes reports of seven kinds from shipped scenarios.
'use strict';
const { spawnSync } = require('node:child_process');
const path = require('node:path');

const run = (words, allowed = [0]) => {
  const { status, stderr } = spawnSync(process.env.TRUETRIAD, words, { encoding: 'utf8' });
  if (!allowed.includes(status)) throw new Error(`${words.join(' ')}: ${status} ${stderr}`);
};

const kKinds = [
  { name: 'accelerometer', experiment: 'accelerometer-only' },
  { name: 'joint', experiment: 'joint' },
  { name: 'nine-axis', experiment: 'nine-axis', mostPages: 4, spheres: 2 },
  { name: 'tumble', experiment: 'tumble', scenario: 'tumble-by-hand' },
  { name: 'soak', experiment: 'thermal-soak', scenario: 'thermal-soak', hasPoses: true, mostPages: 6 },
  { name: 'sweep', experiment: 'thermal-sweep', scenario: 'thermal-sweep', mostBytes: 400e3 },
  { name: 'refused', experiment: 'accelerometer-only', scenario: 'at-rest', isRefused: true },
];

// Each kind, or each that is named, with the folder of its report.html and calibration.json.
const makeReports = (folder, names = []) =>
  kKinds.filter(({ name }) => names.length === 0 || names.includes(name)).map((kind) => {
    const configs = path.join(process.env.SOURCE, 'configs');
    const output = path.join(folder, kind.name);
    const words = ['calibrate', `--config=${configs}/experiments/${kind.experiment}.yaml`, `--output=${output}`, '--interactive=false'];
    if (kind.scenario) {
      const recording = `${output}-recording`;
      run(['simulate', `--config=${configs}/scenarios/${kind.scenario}.yaml`, `--output=${recording}`]);
      words.push(`--input=${recording}/recording.yaml`);
      if (kind.hasPoses) words.push(`--set=poses.file=${recording}/poses.yaml`);
    }
    run(words, kind.isRefused ? [3] : [0]);
    if (kind.spheres) run(['report', `--calibration=${output}/calibration.yaml`, `--output=${output}/turning.html`]);
    return { ...kind, folder: output };
  });

// Pages of other verbs, made of the demo and its calibration.
const makePages = (folder) => {
  const root = process.env.SOURCE;
  const recording = `--input=${root}/datasets/demo/recording.csv`;
  const at = (name) => path.join(folder, name);
  const calibration = at('demo/calibration.yaml');
  run(['calibrate', `--config=${root}/configs/experiments/joint.yaml`, `--output=${at('demo')}`]);
  run(['inspect', recording, `--report=${at('inspect.html')}`]);
  run(['evaluate', `--calibration=${calibration}`, recording, `--report=${at('evaluate.html')}`]);
  run(['compare', `--a=${root}/datasets/demo/truth.yaml`, `--b=${calibration}`, `--report=${at('compare.html')}`]);
  run(['plan', `--config=${root}/configs/plans/joint-12.yaml`, `--output=${folder}`]);
  run(['export', `--calibration=${calibration}`, '--to=record', `--output=${at('record.html')}`]);
  return ['inspect', 'evaluate', 'compare', 'program', 'record'].map((name) => ({ name, folder, file: `${name}.html` }));
};

module.exports = { makePages, makeReports };
