// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "data/pose_fields.h"
#include "io/calibration_tree.h"
#include "tree/to_tree.h"
#include "truetriad/planning/plan.h"

namespace truetriad {

// The fields of the result of `plan` (tree/fields.h).

template <class V>
void Fields(V& visit, Like<PlannedSigma> auto& sigma) {
  visit("parameter", sigma.name);
  visit("unit", sigma.unit);
  visit("before", sigma.before);
  visit("after", sigma.after);
}

template <class V>
void Fields(V& visit, Like<WantedSigma> auto& wanted) {
  visit("group", wanted.group);
  visit("wanted", wanted.wanted);
  visit("reached", wanted.reached);
  visit("met", wanted.met);
  visit.OrNull("poses_needed", wanted.poses_needed);
}

template <class V>
void Fields(V& visit, Like<Plan> auto& plan) {
  visit("met", plan.IsMet());
  visit("determined", plan.determined);
  visit("rehearsed", plan.rehearsed);
  visit("measured_poses", plan.measured_poses);
  visit("rest_s", plan.rest_s);
  visit("program", plan.program);
  visit("sigmas", plan.sigmas);
  visit("wanted", plan.wanted);
  visit("messages", plan.messages);
}

/// The plan as JSON; its program has the keys of its YAML file.
inline Json PlanTree(const Plan& plan) {
  Json tree = ToTree(plan);
  tree["program"] = AsInYaml(std::move(tree["program"]));
  return tree;
}

}  // namespace truetriad
