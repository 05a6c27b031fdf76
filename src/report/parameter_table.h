// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// σ of linear combinations of named parameters. Keeps a reference to the covariance.
class Propagation {
 public:
  explicit Propagation(const NamedCovariance& covariance);

  using Term = std::pair<std::string, double>;

  /// sqrt(J P J^T) for the derivatives J by name; nullopt when a name is not in the covariance.
  std::optional<double> Sigma(const std::vector<Term>& derivatives) const;

  bool Has(const std::string& name) const { return index_.contains(name); }

 private:
  const NamedCovariance& covariance_;
  std::map<std::string, Eigen::Index> index_;
};

/// Bias, scale and scale error (or the whole matrix where the axes are permuted), temperature terms
/// and noise of one triad, with σ; one column an axis.
Table ParameterTable(const TriadCalibration& sensor, Triad triad, const Propagation& propagation);

/// How much of each body axis (columns) a chip's axis (rows) senses, with σ, in mrad and degrees.
/// Empty where the axes are permuted.
Table MisalignmentTable(const TriadCalibration& sensor,
                        Triad triad,
                        const Propagation& propagation);

/// C and b of corrected = C (raw - b), as firmware needs them: rows of C by body axis, b by chip
/// axis.
Table CorrectionTable(const TriadCalibration& sensor, Triad triad);

/// Gravity, field and temperature, and where each value comes from.
Table ReferenceTable(const ReferenceValues& reference, const Propagation& propagation);

}  // namespace truetriad
