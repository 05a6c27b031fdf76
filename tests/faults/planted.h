// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "faults/fault_trials.h"
#include "truetriad/math/rotation.h"

namespace truetriad::trials {

// A fault that is put into the readings of a trial, and by what name it should be found.
struct Planted {
  std::string_view name;
  Triad triad;
  bool needs_gyroscope;
  void (*plant)(FaultTrial* trial);
};

inline const Eigen::Vector3d kSome(0.8, -1.0, 0.6);

// The time of pose k, from -1 to 1 over the run.
inline double TauOf(const FaultTrial& trial, std::size_t k) {
  return 2.0 * static_cast<double>(k) / static_cast<double>(trial.attitudes.size() - 1) - 1.0;
}

// Changes every reading of a triad at rest: `change` gets u = S x, the pose and the readings.
template <typename Change>
void AtPoses(FaultTrial* trial, Triad triad, Change change) {
  const TriadModel<double>& model = *trial->unit.models[triad];
  for (std::size_t k = 0; k < trial->attitudes.size(); ++k) {
    const Eigen::Vector3d x = trial->attitudes[k].conjugate() * trial->unit.WorldVector(triad);
    trial->poses.poses[k].triads[triad]->mean_raw += change(model, x, k);
  }
}

// Changes the gyroscope's readings along turns: `change` gets u, the rate and how many poses have
// gone by.
template <typename Change>
void AlongTurns(FaultTrial* trial, Change change) {
  const TriadModel<double>& model = *trial->unit.models[Triad::kGyroscope];
  for (RecordedMove& move : trial->poses.moves) {
    for (std::size_t i = 0; i < move.gyroscope_raw.size(); ++i) {
      const Eigen::Vector3d u = move.gyroscope_raw[i] - model.bias;
      const double gone = static_cast<double>(move.from) +
                          static_cast<double>(i) / static_cast<double>(move.gyroscope_raw.size());
      const Eigen::Vector3d rate = model.Correction() * u;
      move.gyroscope_raw[i] += change(u, rate, gone);
    }
  }
}

inline Eigen::Vector3d FieldStep(const FaultTrial& trial, double size, std::size_t k) {
  return trial.attitudes[k].conjugate() * (size * kSome);
}

using Model = TriadModel<double>;
using Eigen::Vector3d;

inline const Planted kPlanted[] = {
    {"bias step",
     Triad::kAccelerometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kAccelerometer, [](const Model&, const Vector3d&, std::size_t k) {
         return Vector3d((k >= 9 ? 0.03 : 0.0) * kSome);
       });
     }},
    {"bias step",
     Triad::kMagnetometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [](const Model&, const Vector3d&, std::size_t k) {
         return Vector3d((k >= 12 ? 0.5 : 0.0) * kSome);
       });
     }},
    {"field step",
     Triad::kMagnetometer,
     true,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [t](const Model& model, const Vector3d&, std::size_t k) {
         return Vector3d(k >= 10 ? model.sensitivity * FieldStep(*t, 0.6, k) : Vector3d(0, 0, 0));
       });
     }},
    {"bias for a while",
     Triad::kMagnetometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [](const Model&, const Vector3d&, std::size_t k) {
         return Vector3d((k >= 8 && k < 14 ? 0.5 : 0.0) * kSome);
       });
     }},
    {"bias drift",
     Triad::kAccelerometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kAccelerometer, [t](const Model&, const Vector3d&, std::size_t k) {
         return Vector3d(0.02 * TauOf(*t, k) * kSome);
       });
     }},
    {"gain drift",
     Triad::kMagnetometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [t](const Model& m, const Vector3d& x, std::size_t k) {
         return Vector3d(0.006 * TauOf(*t, k) * kSome.cwiseProduct(m.sensitivity * x));
       });
     }},
    {"gain step",
     Triad::kAccelerometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kAccelerometer, [](const Model& m, const Vector3d& x, std::size_t k) {
         return Vector3d((k >= 12 ? 0.003 : 0.0) * kSome.cwiseProduct(m.sensitivity * x));
       });
     }},
    {"slip",
     Triad::kMagnetometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [](const Model& m, const Vector3d& x, std::size_t k) {
         const Vector3d turned = RotationExp(Vector3d(0.006 * kSome)).conjugate() * x;
         return Vector3d(k >= 11 ? m.sensitivity * (turned - x) : Vector3d(0, 0, 0));
       });
     }},
    {"quadratic term",
     Triad::kAccelerometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kAccelerometer, [](const Model& m, const Vector3d& x, std::size_t) {
         return Vector3d(0.05 * kSome.cwiseProduct((m.sensitivity * x / 10.0).cwiseAbs2()));
       });
     }},
    {"cubic term",
     Triad::kMagnetometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [](const Model& m, const Vector3d& x, std::size_t) {
         const Vector3d u = m.sensitivity * x / 50.0;
         return Vector3d(1.5 * kSome.cwiseProduct(u).cwiseProduct(u.cwiseAbs2()));
       });
     }},
    {"settling",
     Triad::kAccelerometer,
     false,
     [](FaultTrial* t) {
       const Model& model = *t->unit.models[Triad::kAccelerometer];
       const Vector3d world = t->unit.WorldVector(Triad::kAccelerometer);
       AtPoses(t, Triad::kAccelerometer, [&](const Model& m, const Vector3d& x, std::size_t k) {
         if (k == 0) return Vector3d(0, 0, 0);
         return Vector3d(0.001 * model.sensitivity * (t->attitudes[k - 1].conjugate() * world) -
                         0.001 * m.sensitivity * x);
       });
     }},
    {"single pose",
     Triad::kMagnetometer,
     false,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [](const Model&, const Vector3d&, std::size_t k) {
         return Vector3d((k == 7 ? 1.0 : 0.0) * kSome);
       });
     }},
    {"bias by specific force",
     Triad::kMagnetometer,
     true,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kMagnetometer, [t](const Model&, const Vector3d&, std::size_t k) {
         const Vector3d up = t->attitudes[k].conjugate() * Vector3d::UnitZ();
         return Vector3d(0.5 * Vector3d(up.y(), up.z(), up.y()));
       });
     }},
    {"bias by specific force",
     Triad::kGyroscope,
     true,
     [](FaultTrial* t) {
       const auto off = [](const Vector3d& up) {
         return Vector3d(0.002 * Vector3d(up.y(), up.z(), up.x()));
       };
       AtPoses(t, Triad::kGyroscope, [t, off](const Model&, const Vector3d&, std::size_t k) {
         return off(t->attitudes[k].conjugate() * Vector3d::UnitZ());
       });
       for (RecordedMove& move : t->poses.moves) {
         const Model& accelerometer = *t->unit.models[Triad::kAccelerometer];
         for (std::size_t i = 0; i < move.gyroscope_raw.size(); ++i) {
           move.gyroscope_raw[i] +=
               off(accelerometer.TruthFromRaw(move.accelerometer_raw[i]).normalized());
         }
       }
     }},
    {"bias step",
     Triad::kGyroscope,
     true,
     [](FaultTrial* t) {
       AtPoses(t, Triad::kGyroscope, [](const Model&, const Vector3d&, std::size_t k) {
         return Vector3d((k >= 12 ? 0.001 : 0.0) * kSome);
       });
       AlongTurns(t, [](const Vector3d&, const Vector3d&, double gone) {
         return Vector3d((gone >= 11.5 ? 0.001 : 0.0) * kSome);
       });
     }},
    {"gain drift",
     Triad::kGyroscope,
     true,
     [](FaultTrial* t) {
       AlongTurns(t, [t](const Vector3d& u, const Vector3d&, double gone) {
         const double tau = 2.0 * gone / static_cast<double>(t->attitudes.size() - 1) - 1.0;
         return Vector3d(0.004 * tau * kSome.cwiseProduct(u));
       });
     }},
    {"gain by rate",
     Triad::kGyroscope,
     true,
     [](FaultTrial* t) {
       AlongTurns(t, [](const Vector3d& u, const Vector3d& rate, double) {
         return Vector3d(-0.01 * rate.norm() * u);
       });
     }},
    {"asymmetry",
     Triad::kGyroscope,
     true,
     [](FaultTrial* t) {
       AlongTurns(t, [](const Vector3d& u, const Vector3d&, double) {
         return Vector3d(0.004 * kSome.cwiseProduct(u.cwiseAbs()));
       });
     }},
    {"single turn",
     Triad::kGyroscope,
     true,
     [](FaultTrial* t) {
       for (Vector3d& raw : t->poses.moves[5].gyroscope_raw) raw += 0.01 * kSome;
     }},
};

}  // namespace truetriad::trials
