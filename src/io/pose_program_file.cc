// SPDX-License-Identifier: Apache-2.0
#include "io/pose_program_file.h"

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "data/pose_fields.h"
#include "io/field_reader.h"
#include "io/yaml_fields.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// Quaternions written by hand have few digits: if two numbers are 0.7071, the length is wrong by
/// 1e-5. An error above this tolerance is a mistake, such as angles in place of a quaternion.
constexpr double kUnitLengthTolerance = 1e-3;
/// A quaternion whose length is 1 up to rounding is kept, so that a file reads back to the same
/// bits.
constexpr double kExactUnitLength = 1e-14;

void ReadAttitude(YamlReader reader, Eigen::Quaterniond* world_from_body) {
  std::vector<double> wxyz;
  if (!reader.Read(&wxyz)) return;
  if (wxyz.size() != 4) {
    reader.Fail("has " + std::to_string(wxyz.size()) +
                " numbers; expected four: [qw, qx, qy, qz], world <- body");
    return;
  }
  Eigen::Quaterniond attitude(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  const double length_error = std::abs(attitude.norm() - 1.0);
  // The condition is negated, so that a length that is NaN is refused as well.
  if (!(length_error <= kUnitLengthTolerance)) {
    reader.Fail("is not a rotation; expected a quaternion [qw, qx, qy, qz] of length 1");
    return;
  }
  if (length_error > kExactUnitLength) attitude.normalize();
  *world_from_body = attitude;
}

void PoseFields(FieldReader& visit, ProgramPose& pose) {
  visit.Has("number");  // For people; poses keep the order of the file.
  visit.Require("attitude");
  ReadAttitude(visit.Child("attitude"), &pose.world_from_body);
  visit("temperature_degc", pose.temperature_degc, kTemperatureDegc);
  visit("label", pose.label, kAnyText);
}

}  // namespace

std::string PoseProgramToYaml(const PoseProgram& program) {
  YamlFieldWriter root;
  Fields(root, program);
  return root.text();
}

Result<PoseProgram> ReadPoseProgram(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromFile(path));
  if (!root.Child("program")) {
    // If the file is of another kind, each entry would have several errors; one error is enough.
    return Error(ErrorCode::kWrongFormat,
                 {path, root.line()},
                 "program: is missing, so this is not a pose program; expected `program: "
                 "1` and poses with attitudes, as written by `plan` (the poses.yaml of "
                 "`simulate` has the rows of poses instead)");
  }
  PoseProgram program;
  FieldReader::ReadMap(root, [&program](FieldReader& visit) {
    int version = kVersion;
    visit("program", version, FormatVersion());
    visit.Require("poses");
    visit.List("poses", program.poses, PoseFields);
    visit.Expect(!visit.IsList("poses", true) || !program.poses.empty(),
                 "has no poses; list at least one",
                 "poses");
  });
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return program;
}

}  // namespace truetriad
