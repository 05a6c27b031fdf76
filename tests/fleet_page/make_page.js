// SPDX-License-Identifier: Apache-2.0
'use strict';
const { execFileSync } = require('node:child_process');
const path = require('node:path');

// The page of so many units, in the folder `page` of `folder`.
const makePage = (folder, units) => {
  const store = path.join(folder, 'fleet.db');
  execFileSync(process.env.MAKE_FLEET, [store, String(units)]);
  execFileSync(process.env.TRUETRIAD, ['fleet', 'report', `--store=${store}`, '-o', path.join(folder, 'page')]);
};

module.exports = { makePage };
