// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "trust/trial.h"

namespace truetriad::trust {

// What each mechanism is worth: recordings with it against the same recordings without it.
class Prices {
 public:
  void Add(const Trial& trial);
  // Markdown: the mechanisms, those that avoid the most first, and the finding codes.
  std::string Table() const;

 private:
  struct Price {
    int acted = 0, again = 0;
    int avoided = 0, caused = 0;  // wrong results, if a recording can show the fault
    int kept = 0;                 // right with it, but not without
    int refused = 0;              // though right without it
    int crashed = 0;              // without it
    std::vector<double> sigma_ratios;

    // Scales a count among the trials that were run again to all in which the mechanism acted.
    int OfAll(int count) const { return again > 0 ? (count * acted + again / 2) / again : 0; }
    void Add(const Trial& with, const Trial& without);
  };
  struct Said {
    int runs = 0, refused = 0;
  };

  std::map<Mechanism, Price> prices_;
  std::map<std::string, Said> said_;
};

}  // namespace truetriad::trust
