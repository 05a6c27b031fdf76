// SPDX-License-Identifier: Apache-2.0
// Headers that nearly every file includes; they are precompiled once. No file relies on this
// header: each file includes what it uses. Eigen's decompositions are left out on purpose, see
// math/dense.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
