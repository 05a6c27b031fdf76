#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
// Makes share/truetriad/magnetic/wmm2025.wmm and .wmm.cof, in the format of
// GeographicLib::MagneticModel, from the coefficients in the npm package `geomagnetism`:
//
//   npm install --prefix /tmp/wmm geomagnetism@0.2.0
//   tools/scripts/make_wmm.js /tmp/wmm/node_modules/geomagnetism/data/wmm-2025.json share/truetriad/magnetic
//
// Needed only when a new model is published: the files that the script made are in the repository.
'use strict';
const fs = require('fs');
const path = require('path');

const kId = 'WMM2025A';

// Reorders coefficients from (n, m) = (0,0), (1,0), (1,1), (2,0), … to all n for m = 0, then all n
// for m = 1, and so on.
function byColumns(rows, degree, firstColumn) {
  const columns = [];
  for (let m = firstColumn; m <= degree; ++m) {
    for (let n = m; n <= degree; ++n) columns.push(rows[(n * (n + 1)) / 2 + m]);
  }
  return columns;
}

function block(g, h, degree) {
  const size = ((degree + 1) * (degree + 2)) / 2;
  if (g.length !== size || h.length !== size) throw new Error(`expected ${size} coefficients`);
  const numbers = byColumns(g, degree, 0).concat(byColumns(h, degree, 1));
  if (!numbers.every(Number.isFinite)) throw new Error('a coefficient is not a number');
  const bytes = Buffer.alloc(8 + 8 * numbers.length);
  bytes.writeInt32LE(degree, 0);
  bytes.writeInt32LE(degree, 4);
  numbers.forEach((number, i) => bytes.writeDoubleLE(number, 8 + 8 * i));
  return bytes;
}

function main([source, folder]) {
  if (!source || !folder) {
    process.stderr.write('usage: make_wmm.js wmm-2025.json FOLDER\n');
    process.exit(1);
  }
  const model = JSON.parse(fs.readFileSync(source, 'utf8'));
  if (model.name !== 'WMM-2025' || model.epoch !== 2025) throw new Error(`${source}: this is not the model WMM-2025`);
  const meta = `WMMF-1
# World Magnetic Model 2025, NOAA NCEI and British Geological Survey. Public domain.
Name            wmm2025
Description     World Magnetic Model 2025
ReleaseDate     2024-12-17
Type            linear
Epoch           2025
MinTime         2025
MaxTime         2030
MinHeight       -1000
MaxHeight       850000
Radius          6371200
Normalization   schmidt
NumModels       1
ByteOrder       little
ID              ${kId}
`;
  fs.mkdirSync(folder, { recursive: true });
  fs.writeFileSync(path.join(folder, 'wmm2025.wmm'), meta);
  fs.writeFileSync(path.join(folder, 'wmm2025.wmm.cof'), Buffer.concat([
    Buffer.from(kId, 'latin1'),
    block(model.main_field_coeff_g, model.main_field_coeff_h, model.n_max),
    block(model.secular_var_coeff_g, model.secular_var_coeff_h, model.n_max_sec_var),
  ]));
}

main(process.argv.slice(2));
