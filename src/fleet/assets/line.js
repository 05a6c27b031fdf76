// SPDX-License-Identifier: Apache-2.0
// What the line's statistics say, where the page has them.
'use strict';
(() => {
  const { units } = window.fleet;
  window.fleet.line = {
    show: () => {
      document.getElementById('line').hidden = !units.hasLine;
    },
  };
})();
